// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace semfoam {

// A similarity, x_target = scale * rotation * x_source + translation, such as that between the
// COLMAP frames of two models.
struct Sim3 {
  // > 0.
  double scale = 1;
  // Orthonormal with determinant 1.
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Apply(const Eigen::Vector3d& x) const {
    return scale * (rotation * x) + translation;
  }
};

}  // namespace semfoam
