// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace semfoam {

// Reads Label Studio's own JSON (a list of tasks, each with an image and its annotations): polygons
// and rectangles in percent of the image, and brush masks. Of several annotations of a task the
// first that was not cancelled counts. Other results are left out. Throws UserError, one sentence
// naming the file and the result, where it is damaged or of another form.
ImportedMasks ReadLabelStudio(const std::vector<std::filesystem::path>& files);

// Decodes a brush mask of Label Studio: values of 8 bits, packed as @thi.ng/rle-pack does it, of
// which there must be `count`. Returns nothing where the bytes end before, or hold another number.
std::optional<std::vector<uint8_t>> DecodeBrush(const std::vector<uint8_t>& bytes, int64_t count);

}  // namespace semfoam
