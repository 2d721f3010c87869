// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace semfoam {

// The contrast of a photo in blocks of kSide x kSide pixels, those at the right and lower border
// smaller. It tells where a photo has something to learn: on a plain wall, one pixel tells as much
// as ten. In memory: a byte a block.
class BlockContrast {
 public:
  static constexpr int kSide = 8;
  // The contrast of a block is in units of 1 / kUnits of the range of display values.
  static constexpr int kUnits = 510;

  // Returns the memory of a photo's contrast, in bytes.
  static uint64_t Bytes(int width, int height) { return uint64_t{Blocks(width)} * Blocks(height); }

  // Knows nothing.
  BlockContrast() = default;
  // Measures each block: the root of the variance of the display values over the pixels that
  // `counts` returns true for (empty: all), mean over the channels; 0 without such pixels.
  explicit BlockContrast(const Image8& photo, const std::function<bool(int x, int y)>& counts = {});
  // Takes the Values() of a photo of this width.
  BlockContrast(int width, std::vector<uint8_t> values)
      : across_(static_cast<int>(Blocks(width))), contrast_(std::move(values)) {}

  // Returns the contrast of all blocks, row by row.
  const std::vector<uint8_t>& Values() const { return contrast_; }

  // Returns the contrast of the block with this pixel, 0..255 in units of 1 / kUnits.
  uint8_t At(int x, int y) const {
    return contrast_[static_cast<size_t>(y / kSide) * across_ + x / kSide];
  }

 private:
  // Returns the number of blocks along a side of so many pixels.
  static uint32_t Blocks(int pixels) { return (pixels + kSide - 1) / kSide; }

  int across_ = 0;
  // [blocks] Row by row.
  std::vector<uint8_t> contrast_;
};

}  // namespace semfoam
