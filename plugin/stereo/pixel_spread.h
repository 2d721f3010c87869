// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace semfoam {

// Sums over weighted pixels at (x, y): of 1, x, y, xx, xy, yy.
using PixelSums = Eigen::Array<double, 6, 1>;

// Returns the sums of one pixel of weight 1.
inline PixelSums PixelSumsAt(double x, double y) {
  PixelSums sums;
  sums << 1, x, y, x * x, x * y, y * y;
  return sums;
}

// How weighted pixels are spread over the image.
struct PixelSpread {
  // `sums` must have a positive weight.
  explicit PixelSpread(const PixelSums& sums) {
    const PixelSums means = sums / sums[0];
    mean << means[1], means[2];
    covariance << means[3], means[4], means[4], means[5];
    covariance -= mean * mean.transpose();
    // A pixel has an extent: keeps what is extrapolated across a line of pixels small.
    covariance.diagonal().array() += 0.25;
    inverse_covariance = covariance.inverse();
  }

  // Returns the squared Mahalanobis distance of a pixel from these.
  double SquaredDistance(double x, double y) const {
    const Eigen::Vector2d offset = Eigen::Vector2d(x, y) - mean;
    return offset.dot(inverse_covariance * offset);
  }

  Eigen::Vector2d mean;
  Eigen::Matrix2d covariance, inverse_covariance;
};

}  // namespace semfoam
