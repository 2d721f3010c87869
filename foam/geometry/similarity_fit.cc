// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/similarity_fit.h"

#include "foam/util/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

// The triples of 23 pairs are fewer than the draws.
constexpr uint32_t kFewPairs = 23;
constexpr int kDraws = 2000;
constexpr double kInlierDeviations = 2.5;
// A standard deviation, by the median of absolute deviations.
constexpr double kDeviationOfMedian = 1.4826;
// What rounding leaves of a residual, as a share of the size of the target.
constexpr double kRounding = 1e-9;
constexpr double kLine = 0.01;

using Points = std::vector<Eigen::Vector3d>;
using Indices = std::vector<uint32_t>;

Eigen::Vector3d MeanOf(const Points& points, const Indices& indices) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t i : indices) sum += points[i];
  return sum / static_cast<double>(indices.size());
}

// Returns the standard deviations along the principal axes, ascending.
Eigen::Vector3d SpreadOf(const Points& points, const Indices& indices) {
  const Eigen::Vector3d mean = MeanOf(points, indices);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const uint32_t i : indices) {
    covariance += (points[i] - mean) * (points[i] - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(
      covariance / static_cast<double>(indices.size()), Eigen::EigenvaluesOnly);
  return axes.eigenvalues().cwiseMax(0).cwiseSqrt();
}

bool IsOnLine(const Points& points, const Indices& indices) {
  const Eigen::Vector3d spread = SpreadOf(points, indices);
  return !(spread[1] > kLine * spread[2]);
}

Sim3 FitTo(const Points& source, const Points& target, const Indices& indices) {
  const auto count = static_cast<Eigen::Index>(indices.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  // Without the offset, so that no digits are lost.
  const Eigen::Vector3d source_mean = MeanOf(source, indices);
  const Eigen::Vector3d target_mean = MeanOf(target, indices);
  for (Eigen::Index k = 0; k < count; ++k) {
    from.col(k) = source[indices[k]] - source_mean;
    to.col(k) = target[indices[k]] - target_mean;
  }
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, /*with_scaling=*/true);
  Sim3 fit;
  fit.scale = std::cbrt(matrix.topLeftCorner<3, 3>().determinant());
  fit.rotation = matrix.topLeftCorner<3, 3>() / fit.scale;
  fit.translation = target_mean - fit.scale * (fit.rotation * source_mean);
  return fit;
}

double Residual(const Sim3& fit, const Points& source, const Points& target, uint32_t i) {
  return (target[i] - fit.Apply(source[i])).norm();
}

// Calls visit(indices) for each triple, or for some of them.
template <typename Visit>
void ForTriples(uint32_t count, const Visit& visit) {
  constexpr uint64_t kSeed = 0, kPurpose = 0x73696d33;
  if (count <= kFewPairs) {
    for (uint32_t i = 0; i < count; ++i) {
      for (uint32_t j = i + 1; j < count; ++j) {
        for (uint32_t k = j + 1; k < count; ++k) visit(Indices{i, j, k});
      }
    }
    return;
  }
  for (int draw = 0; draw < kDraws; ++draw) {
    CounterRandom random(kSeed, kPurpose, draw);
    const Indices triple = {random.Below(count), random.Below(count), random.Below(count)};
    if (triple[0] == triple[1] || triple[1] == triple[2] || triple[2] == triple[0]) continue;
    visit(triple);
  }
}

// Returns the pairs that agree with the best fit of three; none where all triples are on lines.
Indices FindInliers(const Points& source, const Points& target) {
  const auto count = static_cast<uint32_t>(source.size());
  // Of so many pairs the residuals are small, in a fit without outliers.
  const size_t half = std::min<size_t>(count, count / 2 + 2) - 1;
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> residuals(count), best;
  ForTriples(count, [&](const Indices& triple) {
    if (IsOnLine(source, triple) || IsOnLine(target, triple)) return;
    const Sim3 fit = FitTo(source, target, triple);
    for (uint32_t i = 0; i < count; ++i) residuals[i] = Residual(fit, source, target, i);
    std::vector<double> sorted = residuals;
    std::nth_element(
        sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(half), sorted.end());
    if (sorted[half] < least) {
      least = sorted[half];
      best = residuals;
    }
  });
  Indices inliers;
  if (best.empty()) return inliers;
  Indices all(count);
  std::iota(all.begin(), all.end(), 0);
  // The correction for few pairs is Rousseeuw and Leroy's; with three there is nothing to leave
  // out.
  const double few = count > 3 ? 1 + 5.0 / (count - 3) : std::numeric_limits<double>::infinity();
  const double limit = std::max(kInlierDeviations * kDeviationOfMedian * few * least,
                                kRounding * SpreadOf(target, all)[2]);
  for (uint32_t i = 0; i < count; ++i) {
    if (count == 3 || best[i] <= limit) inliers.push_back(i);
  }
  return inliers;
}

}  // namespace

std::optional<SimilarityFit> FitSimilarity(const Points& source, const Points& target) {
  CHECK_EQ(source.size(), target.size());
  if (source.size() < 3) return std::nullopt;
  const Indices inliers = FindInliers(source, target);
  if (inliers.size() < 3 || IsOnLine(source, inliers) || IsOnLine(target, inliers)) {
    return std::nullopt;
  }
  SimilarityFit fit;
  fit.target_from_source = FitTo(source, target, inliers);
  fit.is_inlier.assign(source.size(), 0);
  fit.num_inliers = std::ssize(inliers);
  double squares = 0;
  for (const uint32_t i : inliers) {
    fit.is_inlier[i] = 1;
    const double residual = Residual(fit.target_from_source, source, target, i);
    squares += residual * residual;
    fit.max = std::max(fit.max, residual);
  }
  fit.rms = std::sqrt(squares / static_cast<double>(inliers.size()));
  return fit;
}

}  // namespace semfoam
