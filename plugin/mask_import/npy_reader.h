// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <optional>

namespace semfoam {

// Reads the mask of one photo from a NumPy array (npy_file.h): [height][width], or 1 of these, of
// ids that are the same in all photos, as Grounded-SAM-2's tracking writes it; or any number of
// [height][width] of bool, a region each, as SAM's predictor returns them. Names come from the JSON
// of the same stem, beside the file or in json_data/ beside its folder: {"labels": {"1":
// {"class_name": "mug"}}}. Throws UserError, one sentence naming the file, where the array or the
// JSON is damaged or of another form.
std::optional<PictureContents> ReadNpyMask(const std::filesystem::path& file);

}  // namespace semfoam
