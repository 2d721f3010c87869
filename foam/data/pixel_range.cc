// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/pixel_range.h"

#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr uint64_t kTilePurpose = 0x4a1, kShiftPurpose = 0x4a3, kContrastPurpose = 0x4a4,
                   kPartPurpose = 0x4a5;
constexpr int kBlockSide = kTileSide * kTileStep;
constexpr int64_t kDrawnBlock = 256;

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

// Returns the corners of the tiles [first, first + count) of the endless sequence of passes.
std::vector<int64_t> TilesOfPasses(uint64_t seed,
                                   int64_t first,
                                   int64_t count,
                                   const PixelRange& range) {
  std::vector<int64_t> corners(count);
  ParallelForBlocks(count, kDrawnBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const int64_t drawn = first + i;
      const uint64_t pass_seed =
          CounterRandom(seed, kTilePurpose, drawn / range.num_tiles()).Next();
      const int64_t tile = Permute(pass_seed, drawn % range.num_tiles(), range.num_tiles());
      corners[i] = range.TileCorner(tile, pass_seed);
    }
  });
  return corners;
}

// Chooses `num_tiles` of the candidates, the first of which has the number `first`.
std::vector<int64_t> ChooseByContrast(uint64_t seed,
                                      int64_t first,
                                      int num_tiles,
                                      const PixelRange& range,
                                      const std::vector<int64_t>& candidates) {
  // Those of the least keys are drawn.
  std::vector<std::pair<double, int64_t>> keys(candidates.size());
  ParallelForBlocks(candidates.size(), kDrawnBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      CounterRandom random(seed, kContrastPurpose, first + i);
      const bool in_any_case = random.Uniform() * kCandidatesPerTile < kUniformShare;
      // Half a unit, so that blocks without contrast share what the others leave.
      const double weight = range.ContrastAt(candidates[i]) + 0.5;
      keys[i] = {in_any_case ? 0 : -std::log(1 - random.Uniform()) / weight, candidates[i]};
    }
  });
  std::nth_element(keys.begin(), keys.begin() + num_tiles, keys.end());
  std::vector<int64_t> chosen(num_tiles);
  for (int i = 0; i < num_tiles; ++i) chosen[i] = keys[i].second;
  return chosen;
}

}  // namespace

PixelRange::PixelRange(const TrainingViews& views, const std::vector<int>& which) : views_(which) {
  for (const int view : views_) {
    const int64_t width = views.Width(view), height = views.Height(view);
    widths_.push_back(views.Width(view));
    heights_.push_back(views.Height(view));
    ends_.push_back(size() + width * height);
    const auto blocks = [](int64_t pixels) { return (pixels + kBlockSide - 1) / kBlockSide; };
    const int passes = passes_per_draw_.emplace_back(views.PassesPerDraw(view));
    CHECK_GT(passes, 0);
    const int64_t tiles = blocks(width) * blocks(height) * kTileRays;
    tile_ends_.push_back(num_tiles() + (tiles + passes - 1) / passes);
    if (const BlockContrast* const contrast = views.Contrast(view)) contrasts_.push_back(contrast);
  }
  if (contrasts_.size() < views_.size()) contrasts_.clear();
}

size_t PixelRange::PlaceOfView(int64_t index) const {
  return std::upper_bound(ends_.begin(), ends_.end(), index) - ends_.begin();
}

ViewPixel PixelRange::PixelOf(size_t place, int64_t index) const {
  const int64_t local = index - Begin(place);
  return {views_[place],
          static_cast<int>(local % widths_[place]),
          static_cast<int>(local / widths_[place])};
}

ViewPixel PixelRange::At(int64_t index) const { return PixelOf(PlaceOfView(index), index); }

uint8_t PixelRange::ContrastAt(int64_t index) const {
  CHECK(HasContrast());
  const size_t place = PlaceOfView(index);
  const ViewPixel pixel = PixelOf(place, index);
  return contrasts_[place]->At(pixel.x, pixel.y);
}

int64_t PixelRange::TileCorner(int64_t tile, uint64_t shift_seed) const {
  const size_t k =
      std::upper_bound(tile_ends_.begin(), tile_ends_.end(), tile) - tile_ends_.begin();
  int64_t local = tile - (k == 0 ? 0 : tile_ends_[k - 1]);
  if (const int passes = passes_per_draw_[k]; passes > 1) {
    local = local * passes + CounterRandom(shift_seed, kPartPurpose, views_[k]).Below(passes);
  }
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
  const int64_t count = int64_t{num_tiles} * (range.HasContrast() ? kCandidatesPerTile : 1);
  const int64_t first = iteration * count;
  std::vector<int64_t> tiles = TilesOfPasses(seed, first, count, range);
  if (range.HasContrast()) tiles = ChooseByContrast(seed, first, num_tiles, range, tiles);
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

}  // namespace semfoam
