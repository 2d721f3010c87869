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

ImagePair FitExposure(const Image8& render, const Image8& photo) {
  CHECK_EQ(render.width, photo.width);
  CHECK_EQ(render.height, photo.height);
  const int half = render.width / 2;
  std::array<double, 3> products{}, squares{};
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
  ImagePair right;
  right.render = {render.width - half, render.height, {}};
  right.photo = right.render;
  for (int y = 0; y < render.height; ++y) {
    for (int x = half; x < render.width; ++x) {
      const size_t i = 3 * (static_cast<size_t>(y) * render.width + x);
      for (int c = 0; c < 3; ++c) {
        const double gain = products[c] / std::max(squares[c], 1e-12);
        const double light = std::min(gain * LinearFromDisplay(render.data[i + c] / 255.0), 1.0);
        right.render.data.push_back(
            static_cast<uint8_t>(std::nearbyint(255 * DisplayFromLinear(light))));
        right.photo.data.push_back(photo.data[i + c]);
      }
    }
  }
  return right;
}

}  // namespace semfoam
