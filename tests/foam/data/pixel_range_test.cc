// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/pixel_range.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <vector>

#include "tests/foam/synthetic_views.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::Each;

constexpr uint64_t kSeed = 7;

// Returns how often each pixel of the range is drawn by `tiles` of successive iterations, `first`
// tiles left out.
std::vector<int> CountDraws(const SyntheticViews& views,
                            const PixelRange& range,
                            int64_t first,
                            int64_t tiles) {
  std::vector<int> count(range.size(), 0);
  for (int64_t tile = first; tile < first + tiles; ++tile) {
    const ViewPixel corner = range.At(DrawTiles(kSeed, tile, 1, range).front());
    for (int k = 0; k < kTileRays; ++k) {
      const ViewPixel pixel =
          TilePixel(corner, k, views.Width(corner.view), views.Height(corner.view));
      const size_t at =
          std::find(range.views().begin(), range.views().end(), pixel.view) - range.views().begin();
      ++count[range.Begin(at) + int64_t{pixel.y} * views.Width(pixel.view) + pixel.x];
    }
  }
  return count;
}

TEST(DrawTiles, EachPassMeetsEachPixelOnce) {
  const SyntheticViews views(5, 36, 20);
  const PixelRange range(views, {0, 2, 3});
  EXPECT_EQ(range.num_tiles() * kTileRays, range.size());
  for (const int pass : {0, 1, 2}) {
    EXPECT_THAT(CountDraws(views, range, pass * range.num_tiles(), range.num_tiles()), Each(1));
  }
}

// Those at the border that an incomplete block repeats are others in each pass.
TEST(DrawTiles, PixelsOfAnySizeAreMetEquallyOftenInTheMean) {
  const SyntheticViews views(2, 7, 5);
  const PixelRange range(views, {0, 1});
  constexpr int kPasses = 2000;
  const std::vector<int> one = CountDraws(views, range, 0, range.num_tiles());
  EXPECT_GE(*std::min_element(one.begin(), one.end()), 1);
  const std::vector<int> many = CountDraws(views, range, 0, kPasses * range.num_tiles());
  const double mean = double(kPasses) * range.num_tiles() * kTileRays / range.size();
  for (const int count : many) EXPECT_NEAR(count, mean, 0.05 * mean);
}

TEST(DrawTiles, PassesDifferInOrderAndPlace) {
  const SyntheticViews views(4, 64, 48);
  const PixelRange range(views, {1, 2, 3});
  const int num_tiles = static_cast<int>(range.num_tiles() / 8);
  const auto first = DrawTiles(kSeed, 0, num_tiles, range);
  EXPECT_TRUE(std::is_sorted(first.begin(), first.end()));
  EXPECT_EQ(DrawTiles(kSeed, 0, num_tiles, range), first);
  std::vector<int64_t> both;
  for (const auto& other :
       {DrawTiles(kSeed, 8, num_tiles, range), DrawTiles(kSeed + 1, 0, num_tiles, range)}) {
    both.clear();
    std::set_intersection(
        first.begin(), first.end(), other.begin(), other.end(), std::back_inserter(both));
    // Of 1/32 of all corners, drawn twice.
    EXPECT_LT(both.size(), first.size() / 8);
  }
}

// A single pixel, and fewer tiles than one iteration wants.
TEST(DrawTiles, SmallRangesRepeat) {
  const SyntheticViews views(1, 1, 1);
  EXPECT_THAT(DrawTiles(kSeed, 3, 10, PixelRange(views, {0})), Each(0));
}

}  // namespace
}  // namespace semfoam
