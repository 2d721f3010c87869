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

// Numbers the pixels of some views consecutively, in ascending order, so that a uniform index draws
// every pixel equally often. The views must outlive it.
class PixelRange {
 public:
  PixelRange() = default;
  PixelRange(const TrainingViews& views, const std::vector<int>& which);

  int64_t size() const { return ends_.empty() ? 0 : ends_.back(); }
  const std::vector<int>& views() const { return views_; }

  // Returns the pixel of this index.
  ViewPixel At(int64_t index) const;

  // The tiles (below) of a view lie in blocks of 2 kTileStep x 2 kTileStep pixels, kTileRays in a
  // block; they cover each of its pixels once, and those of an incomplete block at the right and
  // lower border once more on the opposite side. Of a view with several PassesPerDraw, only so
  // large a part of them is counted, and which part that is depends on the seed of the shifts.
  int64_t num_tiles() const { return tile_ends_.empty() ? 0 : tile_ends_.back(); }
  // Returns the index of the corner of this tile, with the blocks of each view shifted by random
  // numbers of this seed.
  int64_t TileCorner(int64_t tile, uint64_t shift_seed) const;

  // Returns whether the contrast of all views is known.
  bool HasContrast() const { return !contrasts_.empty(); }
  // Returns the contrast at a pixel (BlockContrast::At). CHECKs HasContrast().
  uint8_t ContrastAt(int64_t index) const;

  // Return the first index of the pixels of views()[k], and one past the last.
  int64_t Begin(size_t k) const { return k == 0 ? 0 : ends_[k - 1]; }
  int64_t End(size_t k) const { return ends_[k]; }

 private:
  // Returns the k for which views()[k] has the pixel of this index.
  size_t PlaceOfView(int64_t index) const;
  ViewPixel PixelOf(size_t place, int64_t index) const;

  std::vector<int> views_;
  std::vector<int> widths_;
  std::vector<int> heights_;
  std::vector<int64_t> ends_;
  std::vector<int> passes_per_draw_;
  std::vector<int64_t> tile_ends_;
  // Empty: that of some view is not known.
  std::vector<const BlockContrast*> contrasts_;
};

// Rays are drawn in tiles of kTileSide x kTileSide pixels, kTileStep apart: near enough to cross
// the same cells, far enough to carry different information.
inline constexpr int kTileSide = 2;
inline constexpr int kTileRays = kTileSide * kTileSide;
inline constexpr int kTileStep = 2;

// Where contrasts are known, tiles are drawn from so many candidates each, and this share of them
// whatever their contrast, so that plain surfaces are seen as well (DrawTiles).
inline constexpr int kCandidatesPerTile = 4;
inline constexpr double kUniformShare = 0.3;

// Draws the tiles of one iteration: returns the indices of their corners in `range`, ascending. The
// tiles of successive iterations run through all tiles of the range in random order, then through
// all of them in another order, and so on, so that as many rays as there are pixels meet each pixel
// once. Where the range has contrasts, these are candidates, kCandidatesPerTile for each tile
// drawn; kUniformShare of the tiles drawn are any of the candidates, and the rest are drawn from
// the others in proportion to the contrast at their corners, without replacement (Efraimidis and
// Spirakis 2006). Depends on its arguments alone, so the tiles of later iterations are known in
// advance.
std::vector<int64_t> DrawTiles(uint64_t seed,
                               int64_t iteration,
                               int num_tiles,
                               const PixelRange& range);

// Returns the k-th pixel (of kTileRays) of the tile with this corner, in a view of width x height
// pixels. Tiles wrap around the photo's border, so that no place is preferred.
inline ViewPixel TilePixel(const ViewPixel& corner, int k, int width, int height) {
  return {corner.view,
          (corner.x + kTileStep * (k % kTileSide)) % width,
          (corner.y + kTileStep * (k / kTileSide)) % height};
}

}  // namespace semfoam
