// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/pixel_range.h"

#include "foam/util/random.h"

#include <algorithm>
#include <utility>

namespace semfoam {
namespace {

constexpr uint64_t kTilePurpose = 0x4a1, kShiftPurpose = 0x4a3;
constexpr int kBlockSide = kTileSide * kTileStep;

// Returns the image of `index` under a random permutation of [0, size): a Feistel network of four
// rounds (Luby and Rackoff 1988) on the next power of four, applied until the image is in range.
int64_t Permute(uint64_t seed, int64_t index, int64_t size) {
  int half_bits = 1;
  while (int64_t{1} << 2 * half_bits < size) ++half_bits;
  const uint64_t mask = (uint64_t{1} << half_bits) - 1;
  auto image = static_cast<uint64_t>(index);
  do {
    uint64_t left = image >> half_bits, right = image & mask;
    for (uint64_t round = 0; round < 4; ++round) {
      const uint64_t next = left ^ (CounterRandom(seed, round, right).Next() & mask);
      left = std::exchange(right, next);
    }
    image = left << half_bits | right;
  } while (image >= static_cast<uint64_t>(size));
  return static_cast<int64_t>(image);
}

}  // namespace

PixelRange::PixelRange(const TrainingViews& views, const std::vector<int>& which) : views_(which) {
  for (const int view : views_) {
    const int64_t width = views.Width(view), height = views.Height(view);
    widths_.push_back(views.Width(view));
    heights_.push_back(views.Height(view));
    ends_.push_back(size() + width * height);
    const auto blocks = [](int64_t pixels) { return (pixels + kBlockSide - 1) / kBlockSide; };
    tile_ends_.push_back(num_tiles() + blocks(width) * blocks(height) * kTileRays);
  }
}

ViewPixel PixelRange::At(int64_t index) const {
  const size_t k = std::upper_bound(ends_.begin(), ends_.end(), index) - ends_.begin();
  const int64_t local = index - Begin(k);
  return {views_[k], static_cast<int>(local % widths_[k]), static_cast<int>(local / widths_[k])};
}

int64_t PixelRange::TileCorner(int64_t tile, uint64_t shift_seed) const {
  const size_t k =
      std::upper_bound(tile_ends_.begin(), tile_ends_.end(), tile) - tile_ends_.begin();
  const int64_t local = tile - (k == 0 ? 0 : tile_ends_[k - 1]);
  const int64_t width = widths_[k], height = heights_[k];
  const int64_t blocks_across = (width + kBlockSide - 1) / kBlockSide;
  const int64_t block = local / kTileRays, corner = local % kTileRays;
  CounterRandom shift(shift_seed, kShiftPurpose, views_[k]);
  const int64_t x = block % blocks_across * kBlockSide + corner % kTileStep + shift.Below(width);
  const int64_t y = block / blocks_across * kBlockSide + corner / kTileStep + shift.Below(height);
  return Begin(k) + y % height * width + x % width;
}

std::vector<int64_t> DrawTiles(uint64_t seed,
                               int64_t iteration,
                               int num_tiles,
                               const PixelRange& range) {
  std::vector<int64_t> tiles(num_tiles);
  for (int i = 0; i < num_tiles; ++i) {
    const int64_t drawn = iteration * num_tiles + i;
    const uint64_t pass_seed = CounterRandom(seed, kTilePurpose, drawn / range.num_tiles()).Next();
    const int64_t tile = Permute(pass_seed, drawn % range.num_tiles(), range.num_tiles());
    tiles[i] = range.TileCorner(tile, pass_seed);
  }
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

}  // namespace semfoam
