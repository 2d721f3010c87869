// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Turns the view dependence of colours along with the thing that shows them: after Apply, a cell
// shows along the direction rotation * d what it showed along d. Each degree l of the spherical
// harmonics is closed under rotation (Wigner's matrices of 2 l + 1 rows); they are found here by
// least squares from the basis itself at fixed directions, which is exact to rounding and holds for
// whatever constants and signs ShBasis has.
class ShRotation {
 public:
  // degree 0..3; `rotation` is orthonormal with determinant 1.
  ShRotation(int degree, const Eigen::Matrix3d& rotation);

  // `sh` is [NumShCoefficients(degree)][3], as in Foam::sh; changed in place.
  void Apply(float* sh) const;

 private:
  std::vector<Eigen::MatrixXd> bands_;  // of degree 1, 2, ...: new coefficients from old
};

}  // namespace semfoam
