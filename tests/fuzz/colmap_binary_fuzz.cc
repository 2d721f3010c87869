// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/colmap_model_formats.h"

#include <string>

#include "tests/fuzz/colmap_input.h"

// Models in COLMAP's binary format. What is read and written back must be the same bytes.
namespace semfoam {

const double kLargestBlockPerByte = 16;

namespace {

void CheckWriting(const Reconstruction& model, const std::vector<std::string_view>& parts) {
  Require(CamerasToBinary(model.cameras) == parts[0], "cameras come back byte for byte");
  Require(ImagesToBinary(model.images) == parts[1], "images come back byte for byte");
  Require(PointsToBinary(model.points) == parts[2], "points come back byte for byte");
  if (model.rigs) Require(RigsToBinary(*model.rigs) == parts[3], "rigs come back byte for byte");
  if (model.frames) {
    Require(FramesToBinary(*model.frames) == parts[4], "frames come back byte for byte");
  }
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::ModelInput input(semfoam::ModelFormat::kBinary);
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto model = input.Read(bytes);
  if (model) semfoam::CheckWriting(*model, semfoam::Parts(bytes));
  return 0;
}
