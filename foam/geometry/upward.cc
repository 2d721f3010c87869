// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/upward.h"

#include "foam/util/median.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

namespace semfoam {
namespace {

// Below this unit vectors cancel out rather than agree.
constexpr double kMinAgreement = 0.2;
constexpr double kDegree = std::numbers::pi / 180;
// The roll of cameras that people hold upright.
constexpr double kRoll = 4 * kDegree;
constexpr int kDraws = 1000;
constexpr int kRefinements = 30;
// The x axes determine a plane if their second moment across the first axis is at least this (views
// spread over some 20 degrees), and so many times as large as that out of the plane.
constexpr double kLeastMoment = 0.01;
constexpr double kLeastRatio = 9;
// Cameras on average look at least so far down (or up) to tell it, as the sine of the pitch.
constexpr double kLeastPitch = 0.2;

using Directions = std::vector<Eigen::Vector3d>;

double AngleDegrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  // Not by an arc cosine, which has no digits for small angles.
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

Eigen::Vector3d MeanOf(const Directions& directions) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : directions) sum += x;
  return sum / static_cast<double>(directions.size());
}

// Returns the direction with the least sum of distances to the unit vectors (Weiszfeld).
Eigen::Vector3d MedianDirection(const Directions& directions) {
  constexpr double kLeastDistance = 1e-3;
  Eigen::Vector3d median = MeanOf(directions).normalized();
  for (int k = 0; k < kRefinements; ++k) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& x : directions)
      sum += x / std::max((x - median).norm(), kLeastDistance);
    median = sum.normalized();
  }
  return median;
}

// The sum over the axes of their squared sines against the horizontal, each at most that of a roll.
double CostOf(const Directions& axes, const Eigen::Vector3d& up) {
  const double most = std::sin(kRoll) * std::sin(kRoll);
  double cost = 0;
  for (const Eigen::Vector3d& x : axes) cost += std::min(x.dot(up) * x.dot(up), most);
  return cost;
}

// Returns the direction perpendicular to most of the axes; nothing where they do not determine one.
std::optional<Eigen::Vector3d> NormalOfAxes(const Directions& axes) {
  constexpr uint64_t kSeed = 0, kPurpose = 0x7570;
  constexpr double kParallel = 0.05;
  const auto count = static_cast<uint32_t>(axes.size());
  std::optional<Eigen::Vector3d> up;
  double least = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    CounterRandom random(kSeed, kPurpose, draw);
    const uint32_t i = random.Below(count), j = random.Below(count);
    const Eigen::Vector3d normal = axes[i].cross(axes[j]);
    if (!(normal.norm() > kParallel)) continue;
    const Eigen::Vector3d candidate = normal.normalized();
    const double cost = CostOf(axes, candidate);
    if (!up || cost < least) {
      least = cost;
      up = candidate;
    }
  }
  if (!up) return std::nullopt;
  Eigen::Vector3d moments;
  for (int k = 0; k < kRefinements; ++k) {
    // Cauchy's weights.
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    double total = 0;
    for (const Eigen::Vector3d& x : axes) {
      const double deviation = x.dot(*up) / std::sin(kRoll);
      const double weight = 1 / (1 + deviation * deviation);
      sum += weight * (x * x.transpose());
      total += weight;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum / total);
    moments = solver.eigenvalues();
    up = solver.eigenvectors().col(0);
  }
  if (!(moments[1] > kLeastMoment && moments[1] > kLeastRatio * moments[0])) return std::nullopt;
  return up;
}

}  // namespace

std::optional<CameraUp> UpOfCameras(const std::vector<Eigen::Quaterniond>& cam_from_world) {
  if (cam_from_world.empty()) return std::nullopt;
  Directions right, upward, forward;
  for (const Eigen::Quaterniond& rotation : cam_from_world) {
    const Eigen::Matrix3d axes = rotation.normalized().toRotationMatrix();
    right.emplace_back(axes.row(0));
    upward.emplace_back(-axes.row(1));
    forward.emplace_back(axes.row(2));
  }
  const Eigen::Vector3d mean_up = MeanOf(upward);
  CameraUp result;
  if (std::optional<Eigen::Vector3d> up = NormalOfAxes(right)) {
    const double agreement = mean_up.dot(*up), pitch = -MeanOf(forward).dot(*up);
    const bool by_up = std::abs(agreement) >= kMinAgreement;
    if (by_up || std::abs(pitch) >= kLeastPitch) {
      result.up = (by_up ? agreement : pitch) > 0 ? *up : Eigen::Vector3d(-*up);
      result.by_horizon = true;
    }
  }
  if (!result.by_horizon) {
    if (mean_up.norm() < kMinAgreement) return std::nullopt;
    result.up = MedianDirection(upward);
  }
  std::vector<double> off;
  for (size_t i = 0; i < right.size(); ++i) {
    off.push_back(result.by_horizon ? std::abs(90 - AngleDegrees(right[i], result.up))
                                    : AngleDegrees(upward[i], result.up));
  }
  result.spread_degrees = Median(off);
  return result;
}

}  // namespace semfoam
