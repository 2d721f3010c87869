// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/depth_filling.h"

#include "plugin/stereo/image_paths.h"
#include "plugin/stereo/pixel_spread.h"

#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kReaches[] = {4, 8, 16, 32};
constexpr double kColorReach = 0.08;
constexpr double kLeastWeight = 2;
constexpr double kMostSquaredDistance = 2;
constexpr double kMostDeviation = 0.02;

// Weighted sums over known pixels at (x, y) of inverse depth d: PixelSums, then of d, xd, yd and
// dd.
using Sums = Eigen::Array<double, 10, 1>;

// Returns the sums of each pixel alone; zeros where it is unknown.
std::vector<Sums> OwnSums(const DepthMap& known, int width) {
  std::vector<Sums> own(known.inverse.size(), Sums::Zero());
  for (size_t i = 0; i < own.size(); ++i) {
    const double d = known.inverse[i];
    if (!(d > 0)) continue;
    const auto x = static_cast<double>(i % width), y = static_cast<double>(i / width);
    own[i] << PixelSumsAt(x, y), d, x * d, y * d, d * d;
  }
  return own;
}

// Returns the inverse depth at pixel (x, y) of the plane fitted to those of `sums`, where they say
// it.
std::optional<double> InverseDepthAt(double x, double y, const Sums& sums) {
  if (!(sums[0] >= kLeastWeight)) return {};
  const PixelSpread spread(sums.head<6>());
  if (!(spread.SquaredDistance(x, y) <= kMostSquaredDistance)) return {};
  const Eigen::Vector4d mean = sums.tail<4>() / sums[0];
  const Eigen::Vector2d by_depth = mean.segment<2>(1) - spread.mean * mean[0];
  const Eigen::Vector2d slope = spread.inverse_covariance * by_depth;
  const double inverse_depth = mean[0] + slope.dot(Eigen::Vector2d(x, y) - spread.mean);
  const double variance = mean[3] - mean[0] * mean[0] - slope.dot(by_depth);
  const double most = kMostDeviation * inverse_depth;
  if (!(inverse_depth > 0 && variance <= most * most)) return {};
  return inverse_depth;
}

}  // namespace

DepthMap FillDepths(const StereoView& view, const DepthMap& known) {
  CHECK_EQ(known.inverse.size(), view.NumPixels());
  DepthMap filled = known;
  const std::vector<Sums> own = OwnSums(known, view.width);
  const ImagePaths paths(view, kColorReach);
  for (const double reach : kReaches) {
    const std::vector<Sums> sums = paths.SumsAround(own, reach);
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
