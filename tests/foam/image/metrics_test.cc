// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/image/metrics.h"

#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

Image8 Noise(int width, int height, uint64_t seed) {
  Image8 image{width, height, {}};
  CounterRandom random(seed, 0x81, 0);
  for (int i = 0; i < 3 * width * height; ++i) image.data.push_back(random.Below(256));
  return image;
}

// The picture whose channel c has value(x, y, c) at (x, y).
Image8 Picture(int width, int height, const std::function<int(int x, int y, int c)>& value) {
  Image8 image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) image.data.push_back(static_cast<uint8_t>(value(x, y, c)));
    }
  }
  return image;
}

TEST(Metrics, PsnrOfAConstantError) {
  Image8 photo = Noise(20, 10, 1);
  for (uint8_t& v : photo.data) v = v / 2;
  Image8 render = photo;
  for (uint8_t& v : render.data) v += 51;  // a fifth of the peak
  EXPECT_NEAR(Psnr(render, photo), -20 * std::log10(0.2), 1e-12);
  EXPECT_TRUE(std::isinf(Psnr(photo, photo)));
}

TEST(Metrics, SsimIsOneForEqualImagesAndFallsWithNoise) {
  const Image8 photo = Noise(40, 30, 2);
  EXPECT_NEAR(Ssim(photo, photo), 1, 1e-12);
  Image8 slightly = photo, badly = photo;
  CounterRandom random(3, 0x82, 0);
  for (size_t i = 0; i < photo.data.size(); ++i) {
    slightly.data[i] = std::clamp<int>(photo.data[i] + int(random.Below(21)) - 10, 0, 255);
    badly.data[i] = random.Below(256);
  }
  EXPECT_GT(Ssim(slightly, photo), 0.95);
  EXPECT_LT(Ssim(badly, photo), 0.1);
}

TEST(Metrics, SsimOfFlatImagesIsTheLuminanceTerm) {
  // Without structure SSIM is (2 a b + C1) / (a^2 + b^2 + C1), whatever the window and the border
  // do.
  const Image8 a{16, 16, std::vector<uint8_t>(3 * 256, 51)};
  const Image8 b{16, 16, std::vector<uint8_t>(3 * 256, 102)};
  EXPECT_NEAR(Ssim(a, b), (2 * 0.2 * 0.4 + 1e-4) / (0.04 + 0.16 + 1e-4), 1e-9);
}

TEST(Metrics, SsimOfTwoPixelsThatTradePlaces) {
  // Mirrored with the border pixel repeated, the row 0 1 continues as .. 0 1 1 0 0 1 1 0 .., so of
  // the window around the first pixel the offsets -5 -4 -1 0 3 4 show the pixel itself. With p the
  // weight of these, the images (0, 255) and (255, 0) have the means 1 - p and p, both the variance
  // p (1 - p), and the covariance -p (1 - p). The other pixel is the same mirrored.
  const auto weight = [](int offset) { return std::exp(-offset * offset / (2 * 1.5 * 1.5)); };
  double own = 0, all = 0;
  for (const int offset : {-5, -4, -1, 0, 3, 4}) own += weight(offset);
  for (int offset = -5; offset <= 5; ++offset) all += weight(offset);
  const double p = own / all, variance = p * (1 - p), c1 = 1e-4, c2 = 9e-4;
  const double expected = (2 * p * (1 - p) + c1) * (-2 * variance + c2) /
                          ((p * p + (1 - p) * (1 - p) + c1) * (2 * variance + c2));
  EXPECT_NEAR(expected, -0.98864, 1e-5);
  const Image8 photo = Picture(2, 1, [](int x, int, int) { return 255 * x; });
  const Image8 render = Picture(2, 1, [](int x, int, int) { return 255 * (1 - x); });
  EXPECT_NEAR(Ssim(render, photo), expected, 1e-9);
}

TEST(Metrics, SsimOfStructureIsTheDefinitions) {
  // Expected: computed outside of this project from the definition alone, pixel by pixel, with the
  // two-dimensional window exp(-(i^2 + j^2) / (2 * 1.5^2)), i and j from -5 to 5, of sum 1, and
  // with variances and covariance as weighted sums of (a - mean a)^2, (b - mean b)^2 and
  // (a - mean a) (b - mean b). A border mirrored without repeating its pixel gives 0.486, 0.408 and
  // 0.94137 instead.
  const auto chequers = [](int x, int y, int) { return (x / 4 + y / 4) % 2 == 0 ? 50 : 200; };
  EXPECT_NEAR(Ssim(Picture(24, 16, [&](int x, int y, int c) { return chequers(x + 1, y, c); }),
                   Picture(24, 16, chequers)),
              0.4656734,
              1e-6);
  // A slope, and the same with half the contrast and every third row brighter.
  const auto slope = [](int x, int y, int c) { return 20 + 10 * c + 7 * x + 3 * y; };
  EXPECT_NEAR(Ssim(Picture(20,
                           18,
                           [&](int x, int y, int c) {
                             return slope(x, y, c) / 2 + 40 + (y % 3 == 0 ? 30 : 0) + 5 * c;
                           }),
                   Picture(20, 18, slope)),
              0.4041390,
              1e-6);
  // A texture that differs from channel to channel, and the same paler and with another on top.
  const auto texture = [](int x, int y, int c) { return (37 * x + 59 * y + 83 * c + x * y) % 256; };
  EXPECT_NEAR(Ssim(Picture(17,
                           23,
                           [&](int x, int y, int c) {
                             return std::min(255,
                                             texture(x, y, c) * 3 / 4 + (x * x + 5 * y + c) % 40);
                           }),
                   Picture(17, 23, texture)),
              0.9416141,
              1e-6);
}

TEST(MetricsLabelAgreement, IsTheMeanOverTheClassesOfTheTruth) {
  LabelAgreement agreement;
  EXPECT_TRUE(std::isnan(agreement.MeanIou()));
  const auto add = [&](int truth, int shown) {
    agreement.Add(ClassIndex{truth}, ClassIndex{shown});
  };
  add(-1, 2);  // unlabelled: says nothing
  EXPECT_TRUE(std::isnan(agreement.MeanIou()));
  for (int i = 0; i < 3; ++i) add(0, 0);
  add(0, 5);  // shown, but nowhere true: costs class 0, and is no class of its own
  add(3, 3);
  add(3, 0);
  add(3, -1);  // nothing shown
  // Class 0: 3 of 4 + 1. Class 3: 1 of 3.
  EXPECT_DOUBLE_EQ(agreement.MeanIou(), (3.0 / 5 + 1.0 / 3) / 2);
}

}  // namespace
}  // namespace semfoam
