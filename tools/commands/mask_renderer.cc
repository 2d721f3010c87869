// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/label_names.h"
#include "tools/masks/rendered_masks.h"
#include "tools/support/output_lock.h"

#include <string>

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
                          AllNames(kMaskOutputNames),
                          "16-bit PNGs of ids; 8-bit palette PNGs as DEVA, SAM 2 and DAVIS have "
                          "them; or COCO annotations with run lengths and track ids");
  if (!options.Parse(argc, argv)) return;
  const OutputLock lock(output_path);
  const Model model = ReadNamedModel(foam_path, {}, labels_path);
  RequireMaskedPhotos(model, foam_path);
  const size_t count = WriteRenderedMasks(model,
                                          foam_path,
                                          ViewRenderer(model.foam, options.device()),
                                          *ParseEnum(kMaskOutputNames, format),
                                          output_path);
  LOG(INFO) << "Masks of " << count << (count == 1 ? " photo" : " photos") << " are in "
            << output_path;
}

}  // namespace semfoam
