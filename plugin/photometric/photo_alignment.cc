// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/photo_alignment.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace semfoam {
namespace {

// Standard deviations of the Gaussians in samples, one for each step of Gauss-Newton. A foam in
// training is blurred, too.
constexpr double kSigmas[] = {1.8, 1.8, 1.5, 1.2, 1, 1};
constexpr double kFinest = 1;
// Beyond, the Gaussian would be cut off; such a pixel says nothing.
constexpr double kLargestOffset = 3;
// Scale of the errors, in display values, from which on they count less: the root of the mean
// square over channels.
constexpr double kErrorScale = 0.08;
// Standard deviations that the prior expects: of motions, in radians and units of the normalised
// frame, and of the gain; and of the error of a pixel.
constexpr double kMotionPrior = 0.01;
constexpr double kGainPrior = 0.1;
constexpr double kPixelNoise = 0.05;

using Row = std::array<float, kPatchEdge>;

// Fills the weights of the samples of a row, and their slopes; returns sums of both.
std::pair<double, double> Weigh(double offset, double sigma, Row* weights, Row* slopes) {
  double sum = 0, slope_sum = 0;
  for (int k = 0; k < kPatchEdge; ++k) {
    const double distance = k - kPatchRadius - offset;
    const double weight = std::exp(-0.5 * distance * distance / (sigma * sigma));
    const double slope = weight * distance / (sigma * sigma);
    (*weights)[k] = static_cast<float>(weight);
    (*slopes)[k] = static_cast<float>(slope);
    sum += weight;
    slope_sum += slope;
  }
  return {sum, slope_sum};
}

// The pixel's place in the photo of a camera that stands elsewhere; false where it is too far away.
bool FindOffset(const AlignedPixel& pixel,
                const CameraPlacement& placement,
                Eigen::Vector2d* offset) {
  const Eigen::Vector3d seen =
      placement.world_from_cam.transpose() * (pixel.point - placement.center);
  if (!(pixel.frame.direction.dot(seen) > 0)) return false;
  *offset = pixel.frame.OffsetOf(seen);
  return offset->lpNorm<Eigen::Infinity>() <= kLargestOffset;
}

bool IsOf(const AlignedPixel& pixel, int half) { return half < 0 || pixel.half == half; }

}  // namespace

PatchSample SamplePatch(const PhotoPatch& patch, const Eigen::Vector2d& offset, double sigma) {
  Row along_x, along_y, slope_x, slope_y;
  const auto [sum_x, sum_slope_x] = Weigh(offset.x(), sigma, &along_x, &slope_x);
  const auto [sum_y, sum_slope_y] = Weigh(offset.y(), sigma, &along_y, &slope_y);
  PatchSample sample;
  for (int c = 0; c < 3; ++c) {
    float value = 0, by_x = 0, by_y = 0;
    for (int row = 0; row < kPatchEdge; ++row) {
      float of_row = 0, slope_of_row = 0;
      for (int column = 0; column < kPatchEdge; ++column) {
        of_row += along_x[column] * patch.values[c][row][column];
        slope_of_row += slope_x[column] * patch.values[c][row][column];
      }
      value += along_y[row] * of_row;
      by_x += along_y[row] * slope_of_row;
      by_y += slope_y[row] * of_row;
    }
    const double mean = value / (sum_x * sum_y);
    sample.color[c] = mean;
    sample.slope(c, 0) = by_x / (sum_x * sum_y) - mean * sum_slope_x / sum_x;
    sample.slope(c, 1) = by_y / (sum_x * sum_y) - mean * sum_slope_y / sum_y;
  }
  return sample;
}

PhotoAlignment AlignPhoto(const std::vector<AlignedPixel>& pixels,
                          const CameraPlacement& start,
                          int half,
                          bool moves) {
  PhotoAlignment alignment{start, Eigen::Vector3d::Ones()};
  // Since the start, for the prior.
  CameraMotion motion = CameraMotion::Zero();
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  const double motion_prior = std::pow(kPixelNoise / kMotionPrior, 2);
  const double gain_prior = std::pow(kPixelNoise / kGainPrior, 2);
  for (const double sigma : kSigmas) {
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    Vector9 right = Vector9::Zero();
    normal.diagonal().head<6>().setConstant(motion_prior);
    normal.diagonal().tail<3>().setConstant(gain_prior);
    right.head<6>() = -motion_prior * motion;
    right.tail<3>() = gain_prior * (Eigen::Vector3d::Ones() - alignment.gain);
    for (const AlignedPixel& pixel : pixels) {
      Eigen::Vector2d offset;
      if (!IsOf(pixel, half) || !FindOffset(pixel, alignment.placement, &offset)) continue;
      const PatchSample sample = SamplePatch(pixel.photo, offset, sigma);
      const Eigen::Vector3d error = sample.color - alignment.gain.cwiseProduct(pixel.render);
      Eigen::Matrix<double, 3, 9> slope;
      slope.leftCols<6>() =
          sample.slope * OffsetByMotion(pixel.frame, alignment.placement, pixel.point);
      slope.rightCols<3>() = -pixel.render.asDiagonal().toDenseMatrix();
      const double relative = 1 + error.squaredNorm() / (3 * kErrorScale * kErrorScale);
      const double weight = 1 / (relative * relative);
      normal.noalias() += weight * slope.transpose() * slope;
      right.noalias() -= weight * slope.transpose() * error;
    }
    Vector9 step = Vector9::Zero();
    if (moves) {
      step = normal.ldlt().solve(right);
    } else {
      step.tail<3>() = normal.bottomRightCorner<3, 3>().ldlt().solve(right.tail<3>());
    }
    motion += step.head<6>();
    alignment.placement = Moved(alignment.placement, step.head<6>());
    alignment.gain += step.tail<3>();
  }
  return alignment;
}

double AlignmentError(const std::vector<AlignedPixel>& pixels,
                      const PhotoAlignment& alignment,
                      int half) {
  double sum = 0;
  for (const AlignedPixel& pixel : pixels) {
    if (!IsOf(pixel, half)) continue;
    Eigen::Vector2d offset;
    double square = HUGE_VAL;
    if (FindOffset(pixel, alignment.placement, &offset)) {
      const PatchSample sample = SamplePatch(pixel.photo, offset, kFinest);
      square = (sample.color - alignment.gain.cwiseProduct(pixel.render)).squaredNorm() / 3;
    }
    constexpr double kSquare = kErrorScale * kErrorScale;
    sum += std::isinf(square) ? kSquare : kSquare * square / (kSquare + square);
  }
  return sum;
}

}  // namespace semfoam
