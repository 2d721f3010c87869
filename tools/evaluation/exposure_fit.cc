// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/exposure_fit.h"

#include "foam/image/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr uint8_t kDarkest = 5;
constexpr uint8_t kBrightest = 250;

bool IsFit(const uint8_t* render, const uint8_t* photo) {
  for (int c = 0; c < 3; ++c) {
    if (photo[c] <= kDarkest || photo[c] >= kBrightest || render[c] >= kBrightest) return false;
  }
  return true;
}

}  // namespace

Gains FitGains(const Image8& render, const Image8& photo) {
  CHECK_EQ(render.width, photo.width);
  CHECK_EQ(render.height, photo.height);
  const int half = render.width / 2;
  Gains products{}, squares{};
  for (int y = 0; y < render.height; ++y) {
    for (int x = 0; x < half; ++x) {
      const size_t i = 3 * (static_cast<size_t>(y) * render.width + x);
      if (!IsFit(&render.data[i], &photo.data[i])) continue;
      for (int c = 0; c < 3; ++c) {
        const double shown = LinearFromDisplay(render.data[i + c] / 255.0);
        products[c] += shown * LinearFromDisplay(photo.data[i + c] / 255.0);
        squares[c] += shown * shown;
      }
    }
  }
  Gains gains;
  for (int c = 0; c < 3; ++c) gains[c] = products[c] / std::max(squares[c], 1e-12);
  return gains;
}

Image8 WithGains(const Image8& image, const Gains& gains) {
  Image8 result = image;
  for (size_t i = 0; i < result.data.size(); ++i) {
    const double light = std::min(gains[i % 3] * LinearFromDisplay(image.data[i] / 255.0), 1.0);
    result.data[i] = static_cast<uint8_t>(std::nearbyint(255 * DisplayFromLinear(light)));
  }
  return result;
}

Image8 RightHalf(const Image8& image) {
  const int half = image.width / 2;
  Image8 right = {image.width - half, image.height, {}};
  for (int y = 0; y < image.height; ++y) {
    const auto row = image.data.begin() + std::ptrdiff_t{3} * y * image.width;
    right.data.insert(
        right.data.end(), row + std::ptrdiff_t{3} * half, row + std::ptrdiff_t{3} * image.width);
  }
  return right;
}

}  // namespace semfoam
