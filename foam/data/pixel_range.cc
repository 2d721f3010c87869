// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/pixel_range.h"

#include "foam/util/random.h"

#include <algorithm>

namespace semfoam {
namespace {

constexpr uint64_t kTilePurpose = 0x4a1;

}  // namespace

PixelRange::PixelRange(const TrainingViews& views, const std::vector<int>& which) : views_(which) {
  for (const int view : views_) {
    widths_.push_back(views.Width(view));
    ends_.push_back(size() + int64_t{views.Width(view)} * views.Height(view));
  }
}

ViewPixel PixelRange::At(int64_t index) const {
  const size_t k = std::upper_bound(ends_.begin(), ends_.end(), index) - ends_.begin();
  const int64_t local = index - Begin(k);
  return {views_[k], static_cast<int>(local % widths_[k]), static_cast<int>(local / widths_[k])};
}

std::vector<int64_t> DrawTiles(uint64_t seed,
                               int64_t iteration,
                               int num_tiles,
                               int64_t range_size) {
  std::vector<int64_t> tiles(num_tiles);
  for (int i = 0; i < num_tiles; ++i) {
    CounterRandom random(seed, kTilePurpose, uint64_t(iteration) * num_tiles + i);
    tiles[i] = static_cast<int64_t>(random.Uniform() * range_size);
  }
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

}  // namespace semfoam
