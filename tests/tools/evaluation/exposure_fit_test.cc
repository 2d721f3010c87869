// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/exposure_fit.h"

#include "foam/image/metrics.h"
#include "foam/image/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

// A render that has every value and no symmetry.
Image8 Render(int width, int height) {
  Image8 image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.data.push_back(static_cast<uint8_t>((37 * x + 11 * y + 5) % 256));
      image.data.push_back(static_cast<uint8_t>((5 * x + 50 * y + 90) % 256));
      image.data.push_back(static_cast<uint8_t>((90 * x + 13 * y + 20) % 256));
    }
  }
  return image;
}

// That no gain makes equal.
Image8 Photo(const Image8& render) {
  Image8 photo = render;
  for (size_t i = 0; i < photo.data.size(); i += 3) {
    photo.data[i] = static_cast<uint8_t>(render.data[i] * 3 / 4);
    photo.data[i + 1] = static_cast<uint8_t>(render.data[i + 1] * 9 / 10);
    photo.data[i + 2] = static_cast<uint8_t>(std::min(255, render.data[i + 2] * 5 / 4));
  }
  return photo;
}

struct ImagePair {
  Image8 render;
  Image8 photo;
};

// The right halves, the render in the exposure that fits the left ones.
ImagePair RightHalves(const Image8& render, const Image8& photo) {
  return {RightHalf(WithGains(render, FitGains(render, photo))), RightHalf(photo)};
}

// The figures are those of an independent program (numpy) for the same images.
TEST(ExposureFit, AgreesWithAnotherProgram) {
  const Image8 render = Render(33, 24);
  const ImagePair right = RightHalves(render, Photo(render));
  EXPECT_EQ(right.render.width, 17);
  EXPECT_EQ(right.photo.height, 24);
  EXPECT_NEAR(Psnr(right.render, right.photo), 45.78849340095053, 1e-6);
  EXPECT_NEAR(Ssim(right.render, right.photo), 0.9998442083960567, 1e-5);
}

TEST(ExposureFit, FindsTheGainAndLooksAtTheLeftHalfOnly) {
  const Image8 render = Render(40, 30);
  Image8 photo = render;
  for (size_t i = 0; i < photo.data.size(); ++i) {
    const double gain = std::array{0.5, 0.8, 1.3}[i % 3];
    const double light = std::min(1.0, gain * LinearFromDisplay(render.data[i] / 255.0));
    photo.data[i] = static_cast<uint8_t>(std::lround(255 * DisplayFromLinear(light)));
  }
  const ImagePair right = RightHalves(render, photo);
  EXPECT_GT(Psnr(right.render, right.photo), 50);
  EXPECT_LT(Psnr(render, photo), 25);
  // What the right half shows changes nothing of the fit.
  Image8 spoilt = photo;
  for (int y = 0; y < 30; ++y) {
    std::fill_n(spoilt.data.begin() + 3 * (40 * y + 20), 3 * 20, uint8_t{0});
  }
  EXPECT_EQ(RightHalves(render, spoilt).render.data, right.render.data);
}

TEST(ExposureFit, NothingToFitToMakesBlack) {
  const Image8 white{4, 2, std::vector<uint8_t>(24, 255)};
  const ImagePair right = RightHalves(white, white);
  EXPECT_EQ(right.render.data, std::vector<uint8_t>(12, 0));
}

}  // namespace
}  // namespace semfoam
