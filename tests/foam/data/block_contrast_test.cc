// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/block_contrast.h"

#include <gtest/gtest.h>

namespace semfoam {
namespace {

Image8 GrayPhoto(int width, int height, const std::function<uint8_t(int x, int y)>& value) {
  Image8 photo{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) photo.data.insert(photo.data.end(), 3, value(x, y));
  }
  return photo;
}

// The blocks of the right and lower border have 3 and 2 pixels of 8.
constexpr int kWidth = 19, kHeight = 10;

TEST(BlockContrast, IsZeroWhereABlockIsPlain) {
  const BlockContrast contrast(GrayPhoto(
      kWidth, kHeight, [](int x, int y) { return static_cast<uint8_t>(20 * (x / 8) + y / 8); }));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) EXPECT_EQ(contrast.At(x, y), 0) << x << " " << y;
  }
}

TEST(BlockContrast, IsTheStandardDeviation) {
  // Half of the pixels black, half white: the largest there is; in steps of 10 and none elsewhere.
  const BlockContrast contrast(GrayPhoto(kWidth, kHeight, [](int x, int y) {
    if (x < 8 && y < 8) return static_cast<uint8_t>(x % 2 == 0 ? 0 : 255);
    return static_cast<uint8_t>(x >= 16 && y >= 8 ? 100 + 10 * (y - 8) : 7);
  }));
  EXPECT_EQ(contrast.At(7, 7), BlockContrast::kUnits / 2);
  EXPECT_EQ(contrast.At(18, 9), 10);  // 5 / 255 * 510
  EXPECT_EQ(contrast.At(8, 0), 0);
  EXPECT_EQ(contrast.At(0, 8), 0);
}

TEST(BlockContrast, IsTheMeanOverChannelsOfTheVariance) {
  Image8 photo{2, 1, {100, 100, 100, 160, 100, 100}};
  EXPECT_EQ(BlockContrast(photo).At(1, 0), 35);  // 30 / sqrt(3) / 255 * 510 = 34.6
}

TEST(BlockContrast, LeavesOutPixelsThatDoNotCount) {
  const Image8 photo = GrayPhoto(
      kWidth, kHeight, [](int x, int) { return static_cast<uint8_t>(x % 4 == 0 ? 200 : 50); });
  const BlockContrast contrast(photo, [](int x, int) { return x >= 8 && x % 4 != 0; });
  EXPECT_GT(BlockContrast(photo).At(8, 0), 0);
  EXPECT_EQ(contrast.At(8, 0), 0);
  EXPECT_EQ(contrast.At(0, 0), 0) << "nothing counts";
}

}  // namespace
}  // namespace semfoam
