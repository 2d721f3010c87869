// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/colmap_model_formats.h"

#include <string>

#include "tests/fuzz/colmap_input.h"

// Models in COLMAP's text format. What is read, written and read again must be the same.
namespace semfoam {

const double kLargestBlockPerByte = 64;

namespace {

void CheckWriting(const Reconstruction& model) {
  const std::string cameras = CamerasToText(model.cameras);
  Require(CamerasToText(ParseCamerasText("again", cameras)) == cameras, "cameras come back");
  const std::string images = ImagesToText(model.images);
  Require(ImagesToText(ParseImagesText("again", images)) == images, "images come back");
  const std::string points = PointsToText(model.points);
  Require(PointsToText(ParsePointsText("again", points)) == points, "points come back");
  if (model.rigs) {
    const std::string rigs = RigsToText(*model.rigs);
    Require(RigsToText(ParseRigsText("again", rigs)) == rigs, "rigs come back");
  }
  if (model.frames) {
    const std::string frames = FramesToText(*model.frames);
    Require(FramesToText(ParseFramesText("again", frames)) == frames, "frames come back");
  }
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::ModelInput input(semfoam::ModelFormat::kText);
  const auto model = input.Read({reinterpret_cast<const char*>(data), size});
  if (model) semfoam::CheckWriting(*model);
  return 0;
}
