// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <optional>

namespace semfoam {

// Reads a JSON file of one photo that lists its regions with COCO's segmentation:
//   [{"segmentation": {"size": ..., "counts": ...}, "area": ...}, ...]    by SAM's amg.py
//   {"image_path": ..., "annotations": [{"class_name": ..., "segmentation": ..., "score": ...},
//    ...], "img_width": ..., "img_height": ...}                           by Grounded-SAM
// Names the photo by image_path, or else by the file. Returns nothing for another kind of file.
// Throws UserError, one sentence naming the file and the region, where it is damaged.
std::optional<PictureContents> ReadRegionList(const std::filesystem::path& file);

}  // namespace semfoam
