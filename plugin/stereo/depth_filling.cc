// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/depth_filling.h"

#include <cmath>
#include <cstddef>
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

// The weights that are left on the way from a pixel to its right and its lower neighbour.
struct Passes {
  std::vector<double> right, down;
};

Passes PassesOf(const StereoView& view, double reach) {
  Passes passes;
  passes.right.assign(view.NumPixels(), 0);
  passes.down.assign(view.NumPixels(), 0);
  const auto pass = [&](size_t i, size_t j) {
    // Nothing passes where the photo shows nothing.
    if (std::isnan(view.grey[i]) || std::isnan(view.grey[j])) return 0.0;
    const double change = (view.color[i] - view.color[j]).cwiseAbs().maxCoeff();
    return std::exp(-1 / reach - change / kColorReach);
  };
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const size_t i = static_cast<size_t>(y) * view.width + x;
      if (x + 1 < view.width) passes.right[i] = pass(i, i + 1);
      if (y + 1 < view.height) passes.down[i] = pass(i, i + view.width);
    }
  }
  return passes;
}

// Replaces the sums of `count` pixels, `step` apart, by the weighted sums over all of them.
// `passes` of a pixel leads to the next one.
void SumAlong(const double* passes, int count, ptrdiff_t step, Sums* pixels) {
  thread_local std::vector<Sums> from_before;
  from_before.assign(count, Sums::Zero());
  for (int k = 1; k < count; ++k) {
    const ptrdiff_t before = (k - 1) * step;
    from_before[k] = passes[before] * (from_before[k - 1] + pixels[before]);
  }
  Sums from_behind = Sums::Zero();
  for (int k = count - 1; k >= 0; --k) {
    Sums& pixel = pixels[k * step];
    const Sums own = pixel;
    pixel += from_before[k] + from_behind;
    if (k > 0) from_behind = passes[(k - 1) * step] * (from_behind + own);
  }
}

void SumRows(const StereoView& view, const Passes& passes, std::vector<Sums>* sums) {
  for (int y = 0; y < view.height; ++y) {
    const size_t first = static_cast<size_t>(y) * view.width;
    SumAlong(&passes.right[first], view.width, 1, &(*sums)[first]);
  }
}

void SumColumns(const StereoView& view, const Passes& passes, std::vector<Sums>* sums) {
  for (int x = 0; x < view.width; ++x) {
    SumAlong(&passes.down[x], view.height, view.width, &(*sums)[x]);
  }
}

// Returns the mean of the sums by rows, then columns and the other way round.
std::vector<Sums> SumsAround(const StereoView& view, const DepthMap& known, double reach) {
  const Passes passes = PassesOf(view, reach);
  std::vector<Sums> sums = OwnSums(known, view.width);
  SumRows(view, passes, &sums);
  SumColumns(view, passes, &sums);
  std::vector<Sums> other = OwnSums(known, view.width);
  SumColumns(view, passes, &other);
  SumRows(view, passes, &other);
  for (size_t i = 0; i < sums.size(); ++i) sums[i] = 0.5 * (sums[i] + other[i]);
  return sums;
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
  for (const double reach : kReaches) {
    const std::vector<Sums> sums = SumsAround(view, known, reach);
    for (size_t i = 0; i < sums.size(); ++i) {
      if (filled.inverse[i] > 0 || std::isnan(view.grey[i])) continue;
      const auto x = static_cast<double>(i % view.width), y = static_cast<double>(i / view.width);
      filled.inverse[i] = static_cast<float>(InverseDepthAt(x, y, sums[i]).value_or(0));
    }
  }
  return filled;
}

int64_t FillDepthsBytes() {
  constexpr int64_t kBytesOfPixel = 2 * sizeof(Sums) + 2 * sizeof(double);
  return kBytesOfPixel * kStereoPixels * 102 / 100;
}

}  // namespace semfoam
