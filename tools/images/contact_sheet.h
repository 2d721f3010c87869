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

// Pictures in rows, with a caption below each, on as many pages as it takes.

struct SheetTile {
  Image8 picture;       // at most kTileSide on each side (CHECK)
  std::string caption;  // the first line below it
  std::string remark;   // the second, in red, as is a frame around the picture; empty = neither
};

struct SheetLegendEntry {
  std::string name;
  std::array<uint8_t, 3> color = {0, 0, 0};
};

inline constexpr int kTileSide = 240;     // pixels
inline constexpr int kTilesPerPage = 48;  // 6 in a row
inline constexpr int kMostLegendEntries = 32;

// The photo, or grey of the labels' size where it has no pixel, reduced to a tile; over it the
// labels, each in its LabelColor, half transparent and with an outline of one pixel. 0 shows the
// photo. `labels` may have another size than the photo, and no pixel where there are none.
Image8 OverlayTile(const Image8& photo, const LabelImage& labels);

// Writes `num_tiles` tiles, which `tile` makes (called in parallel, for one page at a time), to
// <stem>_1.png, <stem>_2.png, ..., and removes further pages that an earlier run has left there.
// Returns the number of pages. Throws UserError where a page cannot be written, and what `tile`
// throws.
int WriteContactSheet(const std::filesystem::path& stem,
                      const std::string& title,
                      const std::vector<SheetLegendEntry>& legend,
                      int num_tiles,
                      const std::function<SheetTile(int index)>& tile);

}  // namespace semfoam
