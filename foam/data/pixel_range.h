// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// A pixel of a view.
struct ViewPixel {
  int view, x, y;
};

// The pixels of some views, in ascending order, as one range, so that every pixel is drawn equally
// often.
class PixelRange {
 public:
  PixelRange() = default;
  PixelRange(const TrainingViews& views, const std::vector<int>& which);

  int64_t size() const { return ends_.empty() ? 0 : ends_.back(); }
  const std::vector<int>& views() const { return views_; }

  ViewPixel At(int64_t index) const;
  // Where the pixels of the k-th of views() begin.
  int64_t Begin(size_t k) const { return k == 0 ? 0 : ends_[k - 1]; }
  int64_t End(size_t k) const { return ends_[k]; }

 private:
  std::vector<int> views_;
  std::vector<int> widths_;
  std::vector<int64_t> ends_;
};

// Rays are drawn in tiles of kTileSide x kTileSide pixels, kTileStep apart: near enough to share
// cells, far enough not to say the same thing.
inline constexpr int kTileSide = 2;
inline constexpr int kTileRays = kTileSide * kTileSide;
inline constexpr int kTileStep = 2;

// The tiles of one iteration, as indices of their corners into a range of `range_size` pixels,
// ascending. A function of its arguments alone, so what will be drawn is known ahead.
std::vector<int64_t> DrawTiles(uint64_t seed, int64_t iteration, int num_tiles, int64_t range_size);

// The k-th pixel (of kTileRays) of the tile with this corner, in a view of width x height pixels.
// Tiles wrap around the photo's border, so that every pixel is drawn equally often.
inline ViewPixel TilePixel(const ViewPixel& corner, int k, int width, int height) {
  return {corner.view,
          (corner.x + kTileStep * (k % kTileSide)) % width,
          (corner.y + kTileStep * (k / kTileSide)) % height};
}

}  // namespace semfoam
