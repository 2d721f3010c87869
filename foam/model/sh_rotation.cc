// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/sh_rotation.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/foam.h"
#include "foam/model/spherical_harmonics.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <glog/logging.h>

namespace semfoam {

ShRotation::ShRotation(int degree, const Eigen::Matrix3d& rotation) {
  CHECK(degree >= 0 && degree <= 3);
  CHECK((rotation.transpose() * rotation).isIdentity(1e-9) && rotation.determinant() > 0);
  // The guards stand on a Fibonacci sphere: 32 directions, more than enough for 7 unknowns.
  const std::vector<Eigen::Vector3f> directions = GuardSites();
  const int num_basis = NumShCoefficients(degree);
  Eigen::MatrixXd turned(directions.size(), num_basis), original(directions.size(), num_basis);
  for (size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d d = directions[i].cast<double>().normalized();
    std::vector<double> basis(num_basis);
    ShBasis(degree, Eigen::Vector3d(rotation * d), basis.data());
    for (int k = 0; k < num_basis; ++k) turned(i, k) = basis[k];
    ShBasis(degree, d, basis.data());
    for (int k = 0; k < num_basis; ++k) original(i, k) = basis[k];
  }
  for (int l = 1; l <= degree; ++l) {
    const int first = NumShCoefficients(l - 1), count = 2 * l + 1;
    bands_.push_back(turned.middleCols(first, count)
                         .colPivHouseholderQr()
                         .solve(original.middleCols(first, count)));
  }
}

void ShRotation::Apply(float* sh) const {
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  float* first = sh + 3;
  for (const Eigen::MatrixXd& band : bands_) {
    Eigen::Map<Rows> coefficients(first, band.rows(), 3);
    coefficients = (band * coefficients.cast<double>()).cast<float>().eval();
    first += 3 * band.rows();
  }
}

}  // namespace semfoam
