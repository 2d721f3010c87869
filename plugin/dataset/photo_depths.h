// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Depths of the surfaces that a photo shows, as a pinhole camera of its own resolution has them.
struct PhotoDepths {
  int width = 0;
  int height = 0;
  // In pixels of this map; the centre of the first is (0.5, 0.5).
  Eigen::Vector2f focal = Eigen::Vector2f::Ones();
  Eigen::Vector2f center = Eigen::Vector2f::Zero();
  // [height][width] 1 / depth along z, in units of the normalised frame; 0: not known. Empty:
  // nothing is known.
  std::vector<float> inverse;

  // Returns the distance along a ray, of unit direction in the camera's frame, to the surface: that
  // at the bilinear mean of the inverse depths, which is exact on planes. 0 where one of the four
  // pixels around the ray is not known, or where they are not of one surface: they differ by more
  // than 5 %.
  float DistanceAlong(const Eigen::Vector3f& direction) const;

  // Hints that DistanceAlong is about to be called for a pixel at these shares, in [0, 1], of the
  // photo's width and height. Lens distortion is neglected.
  void Prefetch(float share_of_width, float share_of_height) const {
    if (width < 2 || height < 2) return;
    const int left = std::clamp(static_cast<int>(share_of_width * width - 0.5f), 0, width - 2);
    const int top = std::clamp(static_cast<int>(share_of_height * height - 0.5f), 0, height - 2);
    const float* const upper = inverse.data() + static_cast<size_t>(top) * width + left;
    __builtin_prefetch(upper);
    __builtin_prefetch(upper + width);
  }
};

}  // namespace semfoam
