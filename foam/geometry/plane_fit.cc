// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/plane_fit.h"

#include "foam/util/median.h"
#include "foam/util/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kDraws = 4000;
constexpr int kRefinements = 20;
// Standard deviations, and what the median of absolute normal deviations is of one.
constexpr double kInlierDeviations = 2.5;
constexpr double kMedianOfDeviation = 0.6745;
// The least share of the tolerance that the refinement shrinks it to.
constexpr double kLeastTolerance = 0.05;
// Three points are on a line where their triangle's height is below this share of its base; all
// points where their second standard deviation is below this share of the first.
constexpr double kFlatTriangle = 1e-3;
constexpr double kLine = 1e-3;

// Relative to the mean of the points.
struct Plane {
  Eigen::Vector3d normal;
  double offset = 0;  // normal . x

  double Distance(const Eigen::Vector3d& x) const { return std::abs(normal.dot(x) - offset); }
};

// Second moments of the points near a plane.
struct Moments {
  double weight = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

template <typename Accept>
Moments MomentsOf(const std::vector<Eigen::Vector3d>& points,
                  const std::vector<double>& weights,
                  const Accept& accept) {
  Moments moments;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!accept(points[i])) continue;
    moments.weight += weights[i];
    moments.mean += weights[i] * points[i];
  }
  if (!(moments.weight > 0)) return moments;
  moments.mean /= moments.weight;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!accept(points[i])) continue;
    const Eigen::Vector3d x = points[i] - moments.mean;
    moments.covariance += weights[i] / moments.weight * (x * x.transpose());
  }
  return moments;
}

// Returns points drawn in proportion to their weights, at even steps of the cumulative weight.
std::vector<Eigen::Vector3d> DrawJudges(const std::vector<Eigen::Vector3d>& points,
                                        const std::vector<double>& weights,
                                        double total,
                                        size_t num_judges) {
  std::vector<Eigen::Vector3d> judges;
  const auto count = static_cast<double>(num_judges);
  double cumulative = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    cumulative += weights[i];
    while (judges.size() < num_judges &&
           (static_cast<double>(judges.size()) + 0.5) * total < cumulative * count) {
      judges.push_back(points[i]);
    }
  }
  return judges;
}

std::optional<Plane> PlaneThrough(const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const double base = std::max({ab.norm(), ac.norm(), (c - b).norm()});
  const Eigen::Vector3d cross = ab.cross(ac);
  if (!(cross.norm() > kFlatTriangle * base * base)) return std::nullopt;
  const Eigen::Vector3d normal = cross.normalized();
  return Plane{normal, normal.dot(a)};
}

class Limit {
 public:
  explicit Limit(const std::optional<NormalLimit>& limit) {
    if (!limit) return;
    direction_ = limit->direction;
    least_cosine_ = std::cos(limit->max_degrees * std::numbers::pi / 180);
  }
  bool Allows(const Eigen::Vector3d& normal) const {
    return std::abs(normal.dot(direction_)) >= least_cosine_;
  }

 private:
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();
  double least_cosine_ = 0;
};

// Draws planes and returns the one that most judges are near to.
std::optional<Plane> BestOfDraws(const std::vector<Eigen::Vector3d>& judges,
                                 double tolerance,
                                 const Limit& limit) {
  constexpr uint64_t kSeed = 0, kPurpose = 0x706c616e65;
  const auto count = static_cast<uint32_t>(judges.size());
  const double most = tolerance * tolerance;
  std::optional<Plane> best;
  double least_cost = std::numeric_limits<double>::infinity();
  for (int draw = 0; draw < kDraws; ++draw) {
    CounterRandom random(kSeed, kPurpose, draw);
    const std::array<uint32_t, 3> k = {
        random.Below(count), random.Below(count), random.Below(count)};
    const std::optional<Plane> plane = PlaneThrough(judges[k[0]], judges[k[1]], judges[k[2]]);
    if (!plane || !limit.Allows(plane->normal)) continue;
    double cost = 0;
    for (size_t j = 0; j < judges.size() && cost < least_cost; ++j) {
      const double distance = plane->Distance(judges[j]);
      cost += std::min(distance * distance, most);
    }
    if (cost < least_cost) {
      least_cost = cost;
      best = plane;
    }
  }
  return best;
}

// Fits by least squares to the points within `near` of the plane.
std::optional<Plane> Refit(const std::vector<Eigen::Vector3d>& points,
                           const std::vector<double>& weights,
                           const Plane& plane,
                           double near) {
  const Moments moments = MomentsOf(
      points, weights, [&](const Eigen::Vector3d& x) { return plane.Distance(x) <= near; });
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments.covariance);
  if (!(axes.eigenvalues()[1] > kLine * kLine * axes.eigenvalues()[2])) return std::nullopt;
  const Eigen::Vector3d normal = axes.eigenvectors().col(0);
  return Plane{normal, normal.dot(moments.mean)};
}

// Returns the distance from the plane within which points count, by the median distance of those
// within the tolerance.
double InlierDistance(const std::vector<Eigen::Vector3d>& points,
                      const std::vector<double>& weights,
                      const Plane& plane,
                      double tolerance) {
  std::vector<double> distances;
  for (size_t i = 0; i < points.size(); ++i) {
    const double distance = plane.Distance(points[i]);
    if (weights[i] > 0 && distance <= tolerance) distances.push_back(distance);
  }
  if (distances.empty()) return tolerance;
  return std::clamp(kInlierDeviations * Median(std::move(distances)) / kMedianOfDeviation,
                    kLeastTolerance * tolerance,
                    tolerance);
}

}  // namespace

std::optional<PlaneFit> FitPlane(const SurfaceSamples& samples,
                                 const std::optional<NormalLimit>& limit) {
  const std::vector<double>& weights = samples.weights;
  const double tolerance = samples.tolerance;
  CHECK_EQ(samples.points.size(), weights.size());
  CHECK_GT(tolerance, 0);
  CHECK_GT(samples.num_judges, 0u);
  if (std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0; }) < 3) {
    return std::nullopt;
  }
  // Where coordinates have a large offset, digits are left only relative to the middle.
  const auto all = [](const Eigen::Vector3d&) { return true; };
  const Moments moments = MomentsOf(samples.points, weights, all);
  std::vector<Eigen::Vector3d> points;
  points.reserve(samples.points.size());
  for (const Eigen::Vector3d& x : samples.points) points.emplace_back(x - moments.mean);

  const Limit allowed(limit);
  std::optional<Plane> plane = BestOfDraws(
      DrawJudges(points, weights, moments.weight, samples.num_judges), tolerance, allowed);
  double near = tolerance;
  for (int k = 0; k < kRefinements && plane; ++k) {
    const std::optional<Plane> better = Refit(points, weights, *plane, near);
    // Of few points on a line the drawn plane is all that there is.
    if (!better || !allowed.Allows(better->normal)) break;
    plane = better;
    near = InlierDistance(points, weights, *plane, tolerance);
  }
  if (!plane) return std::nullopt;

  const auto is_near = [&](double distance) {
    return [distance, &plane](const Eigen::Vector3d& x) { return plane->Distance(x) <= distance; };
  };
  const Moments inliers = MomentsOf(points, weights, is_near(near));
  PlaneFit fit;
  fit.normal = plane->normal;
  fit.point = moments.mean + inliers.mean -
              (plane->normal.dot(inliers.mean) - plane->offset) * plane->normal;
  double squares = 0, weight = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const double distance = plane->Distance(points[i]);
    if (distance > tolerance) continue;
    weight += weights[i];
    squares += weights[i] * distance * distance;
  }
  fit.rms = weight > 0 ? std::sqrt(squares / weight) : 0;
  fit.share = weight / moments.weight;
  return fit;
}

}  // namespace semfoam
