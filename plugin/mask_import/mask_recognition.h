// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

// Recognises the format of masks by the contents of the files.

enum class MaskFormat {
  kIdPngs,       // id_png_reader.h
  kObjectPngs,   // object_png_reader.h
  kSamFolders,   // sam_folder_reader.h
  kCvat,         // cvat_reader.h
  kCoco,         // coco_reader.h
  kRegionLists,  // region_list_reader.h
  kLabelMe,      // labelme_reader.h
  kLabelStudio,  // label_studio_reader.h
  kYolo,         // yolo_reader.h
  kNumpy         // npy_reader.h
};

struct RecognizedMasks {
  MaskFormat format = MaskFormat::kIdPngs;
  // The folder that the readers' names are relative to.
  std::filesystem::path folder;
  // The files of this format, sorted.
  std::vector<std::filesystem::path> files;
  // Other files that might have been meant as masks, counted by extension: "3 .txt files".
  std::vector<std::string> left_out;
};

// Recognises the masks in a folder, or a single file. `photo_names` tell PNGs of ids, which have
// the names of photos, from those of single objects. Throws UserError, one sentence naming the
// path, where there are none, and where the file that decides is damaged.
RecognizedMasks RecognizeMasks(const std::filesystem::path& path,
                               const std::vector<std::string>& photo_names);

// Does the same, but returns nothing where there are none.
std::optional<RecognizedMasks> FindMasks(const std::filesystem::path& path,
                                         const std::vector<std::string>& photo_names);

// Reads them.
ImportedMasks ReadMasks(const RecognizedMasks& masks);

}  // namespace semfoam
