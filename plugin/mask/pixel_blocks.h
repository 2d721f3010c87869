// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace semfoam {

// A set of square blocks of a photo's pixels: block (c, r) holds the pixels from (c, r) * edge on.
struct PixelBlocks {
  // Edge of a block in pixels; 0: the set is empty.
  int edge = 0;
  int columns = 0;
  // [rows][columns] Whether the block is in the set.
  std::vector<uint8_t> is_in;

  // Pixels right of or below the last block belong to it.
  bool Contains(int x, int y) const {
    if (is_in.empty()) return false;
    const int rows = static_cast<int>(is_in.size()) / columns;
    const int column = std::min(x / edge, columns - 1), row = std::min(y / edge, rows - 1);
    return is_in[static_cast<size_t>(row) * columns + column] != 0;
  }
};

}  // namespace semfoam
