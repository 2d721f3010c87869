// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/pixel_range.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <set>
#include <vector>

#include "tests/foam/synthetic_views.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::Each;
using testing::ElementsAre;

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

// Views of which the second is drawn once in three passes.
class ThinnedViews final : public SyntheticViews {
 public:
  using SyntheticViews::SyntheticViews;
  int PassesPerDraw(int view) const override { return view == 1 ? 3 : 1; }
};

TEST(DrawTiles, ViewsThatCountLessAreDrawnOnceInSeveralPasses) {
  const ThinnedViews views(3, 24, 16);
  const PixelRange range(views, {0, 1, 2});
  constexpr int kTiles = 24 * 16 / kTileRays, kPasses = 300;
  EXPECT_EQ(range.num_tiles(), 2 * kTiles + kTiles / 3);
  std::vector<int> drawn(3, 0);
  std::set<int64_t> corners;
  for (int pass = 0; pass < kPasses; ++pass) {
    for (const int64_t corner :
         DrawTiles(kSeed, pass, static_cast<int>(range.num_tiles()), range)) {
      const int view = range.At(corner).view;
      ++drawn[view];
      if (view == 1) corners.insert(corner);
    }
  }
  EXPECT_THAT(drawn, ElementsAre(kPasses * kTiles, kPasses * kTiles / 3, kPasses * kTiles));
  // None of its pixels is left out for good.
  EXPECT_EQ(corners.size(), 24 * 16);
}

// Views of which the left half is plain and the right half has contrast, as far as known.
class HalfPlainViews final : public TrainingViews {
 public:
  explicit HalfPlainViews(int num_known) : num_known_(num_known) {
    Image8 photo{kWidth, kHeight, std::vector<uint8_t>(3 * kWidth * kHeight, 90)};
    for (int y = 0; y < kHeight; ++y) {
      for (int x = kWidth / 2; x < kWidth; ++x) {
        std::fill_n(photo.data.begin() + 3 * (y * kWidth + x), 3, x % 2 == 0 ? 60 : 120);
      }
    }
    contrast_ = BlockContrast(photo);
  }

  int NumViews() const override { return 3; }
  int Width(int) const override { return kWidth; }
  int Height(int) const override { return kHeight; }
  bool IsHeldOut(int) const override { return false; }
  Eigen::Vector3d Origin(int) const override { return Eigen::Vector3d::Zero(); }
  bool Ray(int, int, int, TrainingRay*) const override { return false; }
  const BlockContrast* Contrast(int view) const override {
    return view < num_known_ ? &contrast_ : nullptr;
  }

  static constexpr int kWidth = 64, kHeight = 48;

 private:
  int num_known_;
  BlockContrast contrast_;
};

// Returns the share of the tiles that are drawn in the left half.
double ShareOfLeftHalf(const PixelRange& range, int iterations, int num_tiles) {
  int64_t left = 0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const std::vector<int64_t> tiles = DrawTiles(kSeed, iteration, num_tiles, range);
    EXPECT_EQ(std::ssize(tiles), num_tiles);
    EXPECT_TRUE(std::is_sorted(tiles.begin(), tiles.end()));
    for (const int64_t tile : tiles) left += range.At(tile).x < HalfPlainViews::kWidth / 2;
  }
  return double(left) / (int64_t{iterations} * num_tiles);
}

TEST(DrawTiles, PlainPixelsAreDrawnLessOftenButDrawn) {
  const HalfPlainViews views(3);
  const PixelRange range(views, {0, 1, 2});
  ASSERT_TRUE(range.HasContrast());
  EXPECT_EQ(range.ContrastAt(range.Begin(1) + 20), 0);
  EXPECT_EQ(range.ContrastAt(range.Begin(1) + 40), 60);
  // The uniform share, half of which falls on the left, and next to nothing of the rest.
  const double share = ShareOfLeftHalf(range, 200, 64);
  EXPECT_GT(share, kUniformShare / 2 - 0.02);
  EXPECT_LT(share, kUniformShare / 2 + 0.03);
  EXPECT_EQ(DrawTiles(kSeed, 5, 64, range), DrawTiles(kSeed, 5, 64, range));
  EXPECT_NE(DrawTiles(kSeed, 5, 64, range), DrawTiles(kSeed + 1, 5, 64, range));
}

TEST(DrawTiles, NoPixelIsPreferredWhereAContrastIsNotKnown) {
  const HalfPlainViews views(2);
  const PixelRange known(views, {0, 1}), some(views, {0, 1, 2});
  EXPECT_TRUE(known.HasContrast());
  EXPECT_FALSE(some.HasContrast());
  EXPECT_NEAR(ShareOfLeftHalf(some, 200, 64), 0.5, 0.02);
}

TEST(DrawTiles, EveryPlainPixelIsMetInTime) {
  const HalfPlainViews views(1);
  const PixelRange range(views, {0});
  std::vector<int> count(range.size(), 0);
  for (int iteration = 0; iteration < 4000; ++iteration) {
    for (const int64_t tile : DrawTiles(kSeed, iteration, 16, range)) {
      for (int k = 0; k < kTileRays; ++k) {
        const ViewPixel pixel =
            TilePixel(range.At(tile), k, HalfPlainViews::kWidth, HalfPlainViews::kHeight);
        ++count[pixel.y * HalfPlainViews::kWidth + pixel.x];
      }
    }
  }
  EXPECT_GT(*std::min_element(count.begin(), count.end()), 0);
}

// A single pixel, and fewer tiles than one iteration wants.
TEST(DrawTiles, SmallRangesRepeat) {
  const SyntheticViews views(1, 1, 1);
  EXPECT_THAT(DrawTiles(kSeed, 3, 10, PixelRange(views, {0})), Each(0));
}

}  // namespace
}  // namespace semfoam
