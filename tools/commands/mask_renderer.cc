// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/label_names.h"
#include "tools/images/view_images.h"
#include "tools/masks/mask_writers.h"
#include "tools/support/output_lock.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

void RunMaskRenderer(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  std::string labels_path;
  std::string format = "png";
  OptionManager options(
      "mask_renderer",
      "Renders the masks of all photos that a foam was trained on: clean, the same ids in all of "
      "them, also of photos without a mask. Writes them as other programs train on them.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption(
      "output_path", &output_path, "folder for a PNG for each photo, or instances.json");
  options.AddDefaultOption(
      "labels_path", &labels_path, "names of the labels; by default labels.json beside the foam");
  options.AddChoiceOption("format",
                          &format,
                          {"png", "palette", "coco"},
                          "16-bit PNGs of ids; 8-bit palette PNGs as DEVA, SAM 2 and DAVIS have "
                          "them; or COCO annotations with run lengths and track ids");
  if (!options.Parse(argc, argv)) return;
  const OutputLock lock(output_path);
  const Model model = ReadNamedModel(foam_path, {}, labels_path);
  if (!model.foam.HasSemantics() || model.photos.empty()) {
    throw UserError(foam_path,
                    model.photos.empty()
                        ? ": has no photos, whose masks could be rendered; a foam as trained "
                          "would be right."
                        : ": has no labels, of which masks could be rendered; a foam trained with "
                          "masks would be right.");
  }
  std::vector<std::string> names;
  for (const PhotoRecord& photo : model.photos) names.push_back(photo.name);
  const MaskOutput output = format == "coco"      ? MaskOutput::kCoco
                            : format == "palette" ? MaskOutput::kPalette
                                                  : MaskOutput::kPng16;
  const std::unique_ptr<MaskWriter> writer =
      MakeMaskWriter(output, output_path, names, model.labels);
  const ViewRenderer renderer(model.foam, options.device());
  for (const PhotoRecord& photo : model.photos) {
    const RenderedView view =
        renderer.Render(MakeCameraRays(photo, model.world_from_normalized, foam_path));
    writer->Add(photo.name, IdImage(view, model.labels));
  }
  writer->Finish();
  LOG(INFO) << "Masks of " << names.size() << (names.size() == 1 ? " photo" : " photos")
            << " are in " << output_path;
}

}  // namespace semfoam
