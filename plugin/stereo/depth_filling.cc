// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/depth_filling.h"

#include "plugin/stereo/image_paths.h"

#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kReaches[] = {4, 8, 16, 32};
constexpr double kColorReach = 0.08;
constexpr double kLeastWeight = 2;
constexpr double kMostSquaredDistance = 2;
constexpr double kMostDeviation = 0.02;

// Weighted sums over known pixels at (x, y) of inverse depth d: of 1, x, y, xx, xy, yy, d, xd, yd
// and dd.
using Sums = Eigen::Array<double, 10, 1>;

// Returns the sums of each pixel alone; zeros where it is unknown.
std::vector<Sums> OwnSums(const DepthMap& known, int width) {
  std::vector<Sums> own(known.inverse.size(), Sums::Zero());
  for (size_t i = 0; i < own.size(); ++i) {
    const double d = known.inverse[i];
    if (!(d > 0)) continue;
    const auto x = static_cast<double>(i % width), y = static_cast<double>(i / width);
    own[i] << 1, x, y, x * x, x * y, y * y, d, x * d, y * d, d * d;
  }
  return own;
}

// Returns the inverse depth at pixel (x, y) of the plane fitted to those of `sums`, where they say
// it.
std::optional<double> InverseDepthAt(double x, double y, const Sums& sums) {
  if (!(sums[0] >= kLeastWeight)) return {};
  const Sums mean = sums / sums[0];
  const Eigen::Vector2d offset(x - mean[1], y - mean[2]);
  Eigen::Matrix2d covariance;
  covariance << mean[3] - mean[1] * mean[1], mean[4] - mean[1] * mean[2],
      mean[4] - mean[1] * mean[2], mean[5] - mean[2] * mean[2];
  // A pixel has an extent: keeps the slope across a line of pixels small.
  covariance.diagonal().array() += 0.25;
  const Eigen::Matrix2d inverse_covariance = covariance.inverse();
  if (!(offset.dot(inverse_covariance * offset) <= kMostSquaredDistance)) return {};
  const Eigen::Vector2d by_depth(mean[7] - mean[1] * mean[6], mean[8] - mean[2] * mean[6]);
  const Eigen::Vector2d slope = inverse_covariance * by_depth;
  const double inverse_depth = mean[6] + slope.dot(offset);
  const double variance = mean[9] - mean[6] * mean[6] - slope.dot(by_depth);
  const double most = kMostDeviation * inverse_depth;
  if (!(inverse_depth > 0 && variance <= most * most)) return {};
  return inverse_depth;
}

}  // namespace

DepthMap FillDepths(const StereoView& view, const DepthMap& known) {
  CHECK_EQ(known.inverse.size(), view.NumPixels());
  DepthMap filled = known;
  const std::vector<Sums> own = OwnSums(known, view.width);
  for (const double reach : kReaches) {
    const std::vector<Sums> sums = ImagePaths(view, kColorReach, reach).SumsAround(own);
    for (size_t i = 0; i < sums.size(); ++i) {
      if (filled.inverse[i] > 0 || std::isnan(view.grey[i])) continue;
      const auto x = static_cast<double>(i % view.width), y = static_cast<double>(i / view.width);
      filled.inverse[i] = static_cast<float>(InverseDepthAt(x, y, sums[i]).value_or(0));
    }
  }
  return filled;
}

int64_t FillDepthsBytes() {
  constexpr int64_t kBytesOfPixel = 3 * sizeof(Sums) + 2 * sizeof(double);
  return kBytesOfPixel * kStereoPixels * 102 / 100;
}

}  // namespace semfoam
