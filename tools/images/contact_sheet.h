// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace semfoam {

// Draws pictures in rows, with a caption below each, on as many pages as necessary.

struct SheetTile {
  // At most kTileSide on each side (CHECK).
  Image8 picture;
  // First line below the picture.
  std::string caption;
  // Second line, in red, with a red frame around the picture; empty: neither.
  std::string remark;
};

struct SheetLegendEntry {
  std::string name;
  std::array<uint8_t, 3> color = {0, 0, 0};
};

// In pixels.
inline constexpr int kTileSide = 240;
// 6 in a row.
inline constexpr int kTilesPerPage = 48;
inline constexpr int kMostLegendEntries = 32;

// Makes a tile of the photo, or of grey in the labels' size if the photo is empty, with the labels
// over it, each in its LabelColor, half transparent and with an outline of one pixel. Pixels of
// label 0 show the photo. `labels` may have another size than the photo, and may be empty.
Image8 OverlayTile(const Image8& photo, const LabelImage& labels);

// Writes `num_tiles` tiles, which `tile` makes (called in parallel, for one page at a time), to
// <stem>_1.png, <stem>_2.png, ..., and removes further pages of an earlier run. Returns the number
// of pages. Throws UserError where a page cannot be written, and what `tile` throws.
int WriteContactSheet(const std::filesystem::path& stem,
                      const std::string& title,
                      const std::vector<SheetLegendEntry>& legend,
                      int num_tiles,
                      const std::function<SheetTile(int index)>& tile);

}  // namespace semfoam
