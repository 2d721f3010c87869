// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/photo_light.h"

#include "foam/image/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace semfoam {
namespace {

constexpr int kSaturated = 254;
constexpr double kStillWhite = 250.0 / 255;

// Returns the light of each 8-bit display value.
const std::array<double, 256>& LinearTable() {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> values;
    for (int i = 0; i < 256; ++i) values[i] = LinearFromDisplay(i / 255.0);
    return values;
  }();
  return table;
}

}  // namespace

double SquaredRadius(const Eigen::Vector2d& pixel, int width, int height) {
  const Eigen::Vector2d half(0.5 * width, 0.5 * height);
  return (pixel - half).squaredNorm() / half.squaredNorm();
}

Eigen::Vector3d LightAt(const PhotoLight& light, double squared_radius) {
  return light.gain *
         std::exp(squared_radius * (light.falloff[0] + squared_radius * light.falloff[1]));
}

Eigen::Vector3f ReferenceColor(const uint8_t* rgb, const PhotoLight& light, double squared_radius) {
  const Eigen::Vector3d factor = LightAt(light, squared_radius);
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) {
    const double value = DisplayFromLinear(LinearTable()[rgb[c]] / factor[c]);
    if (rgb[c] >= kSaturated && value < kStillWhite) {
      return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    }
    color[c] = static_cast<float>(std::min(value, 1.0));
  }
  return color;
}

}  // namespace semfoam
