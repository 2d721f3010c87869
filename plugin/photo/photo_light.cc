// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/photo_light.h"

#include "foam/image/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>

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

Eigen::Vector2d PlaceInPhoto(const Eigen::Vector2d& pixel, int width, int height) {
  const Eigen::Vector2d half(0.5 * width, 0.5 * height);
  return (pixel - half) / half.norm();
}

Eigen::Matrix<double, kNumShadingTerms, 1> ShadingTerms(const Eigen::Vector2d& place) {
  const double u = place.x(), v = place.y();
  return {u, v, u * u, u * v, v * v};
}

Eigen::Vector3d Toned(const Eigen::Vector3d& light, const Eigen::Matrix3d& tone) {
  constexpr double kLeastLight = 1e-4;
  if (tone == Eigen::Matrix3d::Identity()) return light;
  const Eigen::Vector3d log_light = (light.cwiseMax(kLeastLight) / kMidGrey).array().log();
  return kMidGrey * (tone * log_light).array().exp();
}

Eigen::Vector3d LightAt(const PhotoLight& light, const Eigen::Vector2d& place) {
  const double r2 = place.squaredNorm();
  const double falloff = r2 * (light.falloff[0] + r2 * light.falloff[1]);
  const Eigen::Vector3d shading = light.shading * ShadingTerms(place);
  return light.gain.array() * (shading.array() + falloff).exp();
}

Eigen::Vector3f LeastReferenceColor(const uint8_t* rgb,
                                    const PhotoLight& light,
                                    const Eigen::Vector2d& place,
                                    uint8_t* at_least) {
  const Eigen::Vector3d factor = LightAt(light, place);
  Eigen::Vector3d linear;
  for (int c = 0; c < 3; ++c) linear[c] = LinearTable()[rgb[c]] / factor[c];
  const bool has_tone = light.tone != Eigen::Matrix3d::Identity();
  if (has_tone) linear = Toned(linear, light.tone.inverse());
  *at_least = 0;
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) {
    const double value = DisplayFromLinear(linear[c]);
    if (rgb[c] >= kSaturated && value < kStillWhite) *at_least |= 1 << c;
    color[c] = static_cast<float>(std::min(value, 1.0));
  }
  if (has_tone && *at_least != 0) {
    color.setConstant(std::numeric_limits<float>::quiet_NaN());
    *at_least = 0;
  }
  return color;
}

Eigen::Vector3f ReferenceColor(const uint8_t* rgb,
                               const PhotoLight& light,
                               const Eigen::Vector2d& place) {
  uint8_t at_least = 0;
  const Eigen::Vector3f color = LeastReferenceColor(rgb, light, place, &at_least);
  if (at_least == 0) return color;
  return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
}

Eigen::Vector3f PhotographedColor(const Eigen::Vector3f& reference,
                                  const PhotoLight& light,
                                  const Eigen::Vector2d& place) {
  constexpr double kNearlyWhite = 0.94;
  const Eigen::Vector3d factor = LightAt(light, place);
  const double share =
      std::clamp((reference.minCoeff() - kNearlyWhite) / (kStillWhite - kNearlyWhite), 0.0, 1.0);
  const double whiteness = share * share * (3 - 2 * share);
  Eigen::Vector3d linear;
  for (int c = 0; c < 3; ++c) {
    linear[c] = LinearFromDisplay(std::clamp<double>(reference[c], 0, 1));
  }
  linear = Toned(linear, light.tone);
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) {
    const double value = std::clamp<double>(reference[c], 0, 1);
    const double lit = std::min(DisplayFromLinear(linear[c] * factor[c]), 1.0);
    color[c] = static_cast<float>(lit + whiteness * std::max(0.0, value - lit));
  }
  return color;
}

}  // namespace semfoam
