// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Reads <object>/<frame>.png, or <video>/<object>/<frame>.png, each the mask of one object in one
// photo: 0, and one other value, as SAM 2 writes them (--per_obj_png_file). An object whose folder
// is a number has that id; others are named by their folders. Throws UserError, one sentence naming
// the file, where one is damaged, has more values, or another size than those of other objects.
ImportedMasks ReadObjectPngs(const std::filesystem::path& folder,
                             const std::vector<std::filesystem::path>& files);

// Whether the PNGs are of that kind: each in the folder of its object, below `folder`, and the
// first of each folder with one value at most besides 0, which is 1 or 255. Throws UserError where
// one of these is damaged.
bool AreObjectPngs(const std::filesystem::path& folder,
                   const std::vector<std::filesystem::path>& files);

}  // namespace semfoam
