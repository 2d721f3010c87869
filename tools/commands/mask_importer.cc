// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "plugin/mask_import/mask_import.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

void RunMaskImporter(int argc, char** argv) {
  std::string mask_path;
  std::string image_path;
  std::string output_path;
  std::string same_name = "objects";
  OptionManager options(
      "mask_importer",
      "Converts instance masks of other programs, recognised by their contents, into 16-bit PNGs "
      "of label ids, one for each photo, and labels.json beside them. Reads PNGs of ids or of "
      "single "
      "objects, COCO, LabelMe, Label Studio, YOLO, CVAT, SAM, Grounded-SAM and NumPy masks. Points "
      "and lines of LabelMe are grown into masks.");
  options.AddRequiredOption(
      "mask_path", &mask_path, "the masks: a folder, or a single file such as a COCO JSON");
  options.AddRequiredOption("image_path", &image_path, "folder of the photos");
  options.AddRequiredOption("output_path", &output_path, "folder for the masks and labels.json");
  options.AddChoiceOption(
      "same_name",
      &same_name,
      {"objects", "one"},
      "what several regions of one name in a photo are, in a format without track ids: an object "
      "each (chair_1, chair_2), or parts of one");
  if (!options.Parse(argc, argv)) return;
  const OutputLock lock(output_path);
  const std::vector<std::string> photo_names = PhotoNames(image_path);
  const MaskImport import = ImportMasks(RecognizeMasks(mask_path, photo_names),
                                        image_path,
                                        photo_names,
                                        same_name == "one" ? SameName::kOne : SameName::kObjects,
                                        output_path);
  for (const std::string& line : DescribeImport(import)) LOG(INFO) << line;
  for (const std::string& warning : import.warnings) LOG(WARNING) << warning;
  std::printf("  %5s  %-20s %7s\n", "id", "name", "photos");
  for (const ImportedLabel& label : import.labels) {
    std::printf("  %5d  %-20s %7d\n", label.id, OneLine(label.name).c_str(), label.num_photos);
  }
}

}  // namespace semfoam
