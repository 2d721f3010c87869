// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Rotates the view-dependent colours of an object together with the object: after Apply, the colour
// along the direction rotation * d is the former colour along d. Each degree l of the spherical
// harmonics is closed under rotation (Wigner's matrices of 2 l + 1 rows). The matrices are computed
// by least squares from ShBasis at fixed directions, which is exact to rounding for any constants
// and signs of the basis.
class ShRotation {
 public:
  // `degree` is 0..3; `rotation` is orthonormal with determinant 1.
  ShRotation(int degree, const Eigen::Matrix3d& rotation);

  // Rotates `sh` [NumShCoefficients(degree)][3], laid out as in Foam::sh, in place.
  void Apply(float* sh) const;

 private:
  // Of degree 1, 2, ...: the matrix from old to new coefficients.
  std::vector<Eigen::MatrixXd> bands_;
};

}  // namespace semfoam
