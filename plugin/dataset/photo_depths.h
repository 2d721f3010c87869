// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

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
};

}  // namespace semfoam
