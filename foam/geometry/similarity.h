// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace semfoam {

// Maps the normalised frame, in which the foam lives and trains, to the user's COLMAP frame:
// x_world = scale * x + translation. No rotation, so view directions, SH coefficients and
// axis-aligned boxes are the same in both frames. Kept in double: models with UTM offsets come back
// to the millimetre. A length of the normalised frame is `scale` times as long in the world; a
// density (per unit length) is 1 / scale times as large.
struct Similarity {
  // World units per normalised unit, > 0.
  double scale = 1;
  Eigen::Vector3d translation =
      Eigen::Vector3d::Zero();  // the normalised frame's origin in the world

  Eigen::Vector3d Apply(const Eigen::Vector3d& x_normalized) const {
    return scale * x_normalized + translation;
  }
  Eigen::Vector3d Invert(const Eigen::Vector3d& x_world) const {
    return (x_world - translation) / scale;
  }
};

}  // namespace semfoam
