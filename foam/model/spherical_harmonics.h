// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/util/host_device.h"

#include <Eigen/Core>

namespace semfoam {

// The value of a constant SH basis function: dc = (display value - 0.5) / kShDc.
inline constexpr double kShDc = 0.28209479177387814;

// Evaluates the real spherical harmonics up to `degree` (0..3) at the unit direction d, with the
// constants and signs of 3D Gaussian splatting and Radiant Foam, so that coefficients can be
// exchanged with both. `basis` receives NumShCoefficients(degree) values.
template <typename T>
SEMFOAM_HOST_DEVICE void ShBasis(int degree, const Eigen::Matrix<T, 3, 1>& d, T* basis) {
  const T &x = d[0], &y = d[1], &z = d[2];
  basis[0] = T(kShDc);
  if (degree < 1) return;
  basis[1] = T(-0.4886025119029199) * y;
  basis[2] = T(0.4886025119029199) * z;
  basis[3] = T(-0.4886025119029199) * x;
  if (degree < 2) return;
  const T xx = x * x, yy = y * y, zz = z * z;
  basis[4] = T(1.0925484305920792) * x * y;
  basis[5] = T(-1.0925484305920792) * y * z;
  basis[6] = T(0.31539156525252005) * (T(2) * zz - xx - yy);
  basis[7] = T(-1.0925484305920792) * x * z;
  basis[8] = T(0.5462742152960396) * (xx - yy);
  if (degree < 3) return;
  basis[9] = T(-0.5900435899266435) * y * (T(3) * xx - yy);
  basis[10] = T(2.890611442640554) * x * y * z;
  basis[11] = T(-0.4570457994644658) * y * (T(4) * zz - xx - yy);
  basis[12] = T(0.3731763325901154) * z * (T(2) * zz - T(3) * xx - T(3) * yy);
  basis[13] = T(-0.4570457994644658) * x * (T(4) * zz - xx - yy);
  basis[14] = T(1.445305721320277) * z * (xx - yy);
  basis[15] = T(-0.5900435899266435) * x * (xx - T(3) * yy);
}

// Computes the colour of a cell along a ray: max(0, 0.5 + sum of coefficient * basis), per channel.
// `sh` is [num_coefficients][3].
template <typename T, typename Coefficient>
SEMFOAM_HOST_DEVICE void ShColor(const T* basis,
                                 int num_coefficients,
                                 const Coefficient* sh,
                                 T* color) {
  for (int c = 0; c < 3; ++c) color[c] = T(0.5);
  for (int k = 0; k < num_coefficients; ++k) {
    for (int c = 0; c < 3; ++c) color[c] += basis[k] * sh[3 * k + c];
  }
  for (int c = 0; c < 3; ++c) {
    if (!(color[c] > T(0))) color[c] = T(0);
  }
}

// Moves the point at which the SH coefficients hold by `offset`: the colour of a cell with this
// colour gradient stays the same everywhere.
SEMFOAM_HOST_DEVICE inline void ShiftColor(const Eigen::Vector3f& offset,
                                           const float* gradient,
                                           float* sh) {
  for (int a = 0; a < 3; ++a) {
    for (int c = 0; c < 3; ++c) {
      sh[c] += offset[a] * gradient[3 * a + c] * static_cast<float>(1 / kShDc);
    }
  }
}

// Computes the colour of a cell along a ray as ShColor does, at `offset` from its site (see
// Foam::color_gradient, of which `gradient` is one row). Writes to `slope` the derivative of the
// colour by the distance along the unit `direction`, per channel.
template <typename T, typename Coefficient>
SEMFOAM_HOST_DEVICE void LinearColor(const T* basis,
                                     int num_coefficients,
                                     const Coefficient* sh,
                                     const Coefficient* gradient,
                                     const Eigen::Matrix<T, 3, 1>& offset,
                                     const Eigen::Matrix<T, 3, 1>& direction,
                                     T* color,
                                     T* slope) {
  for (int c = 0; c < 3; ++c) {
    color[c] = T(0.5);
    slope[c] = T(0);
    for (int k = 0; k < num_coefficients; ++k) color[c] += basis[k] * sh[3 * k + c];
    for (int a = 0; a < 3; ++a) {
      color[c] += offset[a] * gradient[3 * a + c];
      slope[c] += direction[a] * gradient[3 * a + c];
    }
    if (!(color[c] > T(0))) color[c] = slope[c] = T(0);
  }
}

}  // namespace semfoam
