// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/ray_density.h"

#include <algorithm>
#include <cmath>

namespace semfoam {
namespace {

constexpr int kTexelsPerSide = 32;

// A texel of the cube map, and how much a ray in it counts.
struct Texel {
  int index;
  // 1 / the texel's solid angle, in steradians.
  float per_steradian;
};

Texel TexelOf(const Eigen::Vector3f& direction) {
  int axis;
  const float longest = direction.cwiseAbs().maxCoeff(&axis);
  const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
  // Of the face's square from -1 to 1: the texel's column and row, and its centre.
  int place[2];
  float squared_distance = 1;
  for (int k = 0; k < 2; ++k) {
    const float at = direction[(axis + 1 + k) % 3] / longest;
    place[k] = std::clamp(static_cast<int>((at + 1) * (kTexelsPerSide / 2)), 0, kTexelsPerSide - 1);
    const float center = (static_cast<float>(place[k]) + 0.5f) * (2.f / kTexelsPerSide) - 1;
    squared_distance += center * center;
  }
  // An area dA of the face, at distance d from the eye, covers dA / d^3 of the unit sphere.
  constexpr float kTexelArea = 4.f / (kTexelsPerSide * kTexelsPerSide);
  return {(face * kTexelsPerSide + place[1]) * kTexelsPerSide + place[0],
          squared_distance * std::sqrt(squared_distance) / kTexelArea};
}

}  // namespace

RayDensity::RayDensity() : density_(6 * kTexelsPerSide * kTexelsPerSide, 0.f) {}

void RayDensity::Add(const Eigen::Vector3f& direction) {
  const Texel texel = TexelOf(direction);
  density_[texel.index] += texel.per_steradian;
}

float RayDensity::At(const Eigen::Vector3f& direction) const {
  return density_[TexelOf(direction).index];
}

void RayDensity::Clear() { std::fill(density_.begin(), density_.end(), 0.f); }

}  // namespace semfoam
