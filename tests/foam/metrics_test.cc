// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/metrics.h"

#include "foam/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

Image8 Noise(int width, int height, uint64_t seed) {
  Image8 image{width, height, {}};
  CounterRandom random(seed, 0x81, 0);
  for (int i = 0; i < 3 * width * height; ++i) image.data.push_back(random.Below(256));
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

TEST(LabelAgreement, IsTheMeanOverTheClassesOfTheTruth) {
  LabelAgreement agreement;
  EXPECT_TRUE(std::isnan(agreement.MeanIou()));
  agreement.Add(-1, 2);  // unlabelled: says nothing
  EXPECT_TRUE(std::isnan(agreement.MeanIou()));
  for (int i = 0; i < 3; ++i) agreement.Add(0, 0);
  agreement.Add(0, 5);  // shown, but nowhere true: costs class 0, and is no class of its own
  agreement.Add(3, 3);
  agreement.Add(3, 0);
  agreement.Add(3, -1);  // nothing shown
  // Class 0: 3 of 4 + 1. Class 3: 1 of 3.
  EXPECT_DOUBLE_EQ(agreement.MeanIou(), (3.0 / 5 + 1.0 / 3) / 2);
}

}  // namespace
}  // namespace semfoam
