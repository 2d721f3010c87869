// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// The text "Software" of the images that this program writes, by which it knows them again.
inline constexpr char kImageSoftware[] = "Semantic Foam for COLMAP";

// Writes a 16-bit grey PNG whose values are the label ids, with kImageSoftware, beside its target
// and renames it into place; parent folders are created. CHECKs that ids fit, 0..65535, and that
// there is a pixel. Throws UserError naming the file where it cannot be written.
void WriteLabelPng(const std::filesystem::path& path, const LabelImage& labels);

// Does the same with an 8-bit palette PNG whose indices are the ids, as SAM 2, DAVIS and DEVA write
// them. `colors` [largest id + 1] are its palette, 1 to 256 8-bit display values; CHECKs that ids
// fit.
void WritePalettePng(const std::filesystem::path& path,
                     const LabelImage& labels,
                     const std::vector<std::array<uint8_t, 3>>& colors);

}  // namespace semfoam
