// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace semfoam {

// The ground or the table that things stand on, where it is known to be a plane: the disc of a
// plane and what lies below it. Normalised frame.
struct SolidGround {
  // Of the plane, the points x with up.dot(x) == level. Unit length.
  Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
  float level = 0;
  // Of the disc.
  Eigen::Vector3f middle = Eigen::Vector3f::Zero();
  float radius = 0;
  // Cells on the plane reach so far above it.
  float thickness = 0;

  bool Contains(const Eigen::Vector3f& x) const {
    if (up.dot(x) - level >= thickness) return false;
    const Eigen::Vector3f offset = x - middle;
    const float height = up.dot(offset);
    return offset.squaredNorm() - height * height < radius * radius;
  }
};

}  // namespace semfoam
