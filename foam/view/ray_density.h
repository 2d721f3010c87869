// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// How many of a view's rays go into which direction, for any camera model: counts over the texels
// of a cube map, 2.8 degrees wide.
class RayDensity {
 public:
  RayDensity();

  // Adds a ray. `direction` is of any length but 0.
  void Add(const Eigen::Vector3f& direction);

  // Returns the number of rays per steradian around a direction, of any length but 0: 0 outside the
  // view, and less than inside within a texel of its border.
  float At(const Eigen::Vector3f& direction) const;

  void Clear();

 private:
  // [6 faces][rows][columns] Rays per steradian.
  std::vector<float> density_;
};

}  // namespace semfoam
