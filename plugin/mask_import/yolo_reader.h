// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Reads YOLO's segments: a .txt file for each photo, a line "class x y x y ..." for each region, in
// shares of the photo's sides. Boxes (lines of four numbers) are left out. Names come from
// data.yaml or classes.txt (also obj.names), in the folder of the labels or up to two above it;
// without these a class is named class_<number>. Files that do not begin with a number are left
// out. Throws UserError, one sentence naming the file and the line, where one is damaged.
ImportedMasks ReadYolo(const std::filesystem::path& folder,
                       const std::vector<std::filesystem::path>& files);

// Whether a text begins as the labels of YOLO do: with a whole number and four more numbers.
bool IsYolo(const std::filesystem::path& file);

// Reads the names of a data.yaml: `names:` with a list or a table of numbers, in one line or in
// several. Throws UserError where it has another form.
std::map<int, std::string> ReadYoloNames(const std::filesystem::path& file);

}  // namespace semfoam
