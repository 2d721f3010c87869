// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/patch_contrast.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kWidth = 60, kHeight = 50;
const Eigen::Vector2d kMiddle(30, 25);

// Waves whose length is this many pixels, each pixel the mean over its width, through a blur that
// leaves `amplitude` of them.
Image8 Waves(double length, double amplitude) {
  Image8 photo{kWidth, kHeight, {}};
  const double k = 2 * M_PI / length;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double wave = (std::cos(k * x) - std::cos(k * (x + 1))) / k;
      const double value = 120 + amplitude * wave;
      for (int c = 0; c < 3; ++c) photo.data.push_back(static_cast<uint8_t>(std::lround(value)));
    }
  }
  return photo;
}

TEST(PatchContrast, IsTheMeanSquareOfNeighboursDifferences) {
  // Columns of 100 and 140 in turn: samples at centres of pixels differ by 40 across and not at all
  // down. Four of seven columns are of the middle's value.
  Image8 photo{kWidth, kHeight, {}};
  for (int i = 0; i < kWidth * kHeight; ++i) {
    for (int c = 0; c < 3; ++c) photo.data.push_back(i % kWidth % 2 == 0 ? 100 : 140);
  }
  const auto contrast = PatchContrast(photo, {30.5, 25.5}, 1);
  ASSERT_TRUE(contrast);
  // The middle, 30, is an even column, and the outermost ones, 27 and 33, are odd.
  const double mean = (3 * 100 + 4 * 140) / 7.0 / 255;
  EXPECT_NEAR(*contrast, 0.5 * std::pow(40 / 255.0 / (mean + 0.02), 2), 1e-6);
  Image8 plain{kWidth, kHeight, std::vector<uint8_t>(3 * kWidth * kHeight, 90)};
  EXPECT_EQ(PatchContrast(plain, kMiddle, 2.5), 0);
}

TEST(PatchContrast, IsTheSameFromNearAndFar) {
  const auto far = PatchContrast(Waves(9, 60), kMiddle, 1);
  const auto near = PatchContrast(Waves(27, 60), kMiddle, 3);
  ASSERT_TRUE(far && near);
  EXPECT_NEAR(*near / *far, 1, 0.15);
  // At the distance of pixels, what is near looks blurred.
  EXPECT_LT(*PatchContrast(Waves(27, 60), kMiddle, 1) / *far, 0.3);
}

TEST(PatchContrast, FallsWithBlur) {
  const auto sharp = PatchContrast(Waves(9, 60), kMiddle, 1);
  const auto blurred = PatchContrast(Waves(9, 30), kMiddle, 1);
  ASSERT_TRUE(sharp && blurred);
  EXPECT_NEAR(*blurred / *sharp, 0.25, 0.03);
}

// One channel of one pixel is enough.
TEST(PatchContrast, IsNotKnownWhereThePhotoIsTooBright) {
  Image8 photo = Waves(9, 60);
  const auto value = [&](int x, int y) -> uint8_t& { return photo.data[3 * (y * kWidth + x) + 1]; };
  value(33, 22) = 249;
  EXPECT_TRUE(PatchContrast(photo, kMiddle, 1));
  value(33, 22) = 250;
  EXPECT_FALSE(PatchContrast(photo, kMiddle, 1));
  EXPECT_TRUE(PatchContrast(photo, kMiddle + Eigen::Vector2d(0, 8), 1));
}

TEST(PatchContrast, IsNotKnownAtTheBorderAndAtOtherSpacings) {
  const Image8 photo = Waves(9, 60);
  for (const double spacing : {0.0, 0.99, 4.01, -1.0, double(NAN), double(INFINITY)}) {
    EXPECT_FALSE(PatchContrast(photo, kMiddle, spacing)) << spacing;
  }
  EXPECT_TRUE(PatchContrast(photo, {4, 4}, 1));
  EXPECT_TRUE(PatchContrast(photo, {14.5, 14.5}, 4));
  EXPECT_FALSE(PatchContrast(photo, {3.9, 25}, 1));
  EXPECT_FALSE(PatchContrast(photo, {14.4, 25}, 4));
  EXPECT_FALSE(PatchContrast(photo, {30, kHeight - 4.0}, 1));
  EXPECT_TRUE(PatchContrast(photo, {30, kHeight - 4.01}, 1));
  EXPECT_FALSE(PatchContrast(photo, {NAN, 25}, 1));
  EXPECT_FALSE(PatchContrast(photo, {30, INFINITY}, 1));
}

}  // namespace
}  // namespace semfoam
