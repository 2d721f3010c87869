// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Reads what the amg.py of SAM writes, a folder for each photo with a mask of one region in each of
// 0.png, 1.png, ..., and metadata.csv; `tables` are the latter. Regions mean nothing from photo to
// photo. Throws UserError, one sentence naming the file, where one is missing, damaged or of
// another size.
ImportedMasks ReadSamFolders(const std::filesystem::path& folder,
                             const std::vector<std::filesystem::path>& tables);

// Whether a file begins as such a metadata.csv does.
bool IsSamTable(const std::filesystem::path& file);

}  // namespace semfoam
