// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/normalized_frame.h"

#include "foam/geometry/guard_sites.h"
#include "foam/util/median.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <glog/logging.h>

namespace semfoam {
namespace {

Eigen::Vector3d MedianPoint(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d result;
  std::vector<double> values(points.size());
  for (int k = 0; k < 3; ++k) {
    for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][k];
    result[k] = Median(values);
  }
  return result;
}

double MedianDistance(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& origin) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector3d& point : points) distances.push_back((point - origin).stableNorm());
  return Median(std::move(distances));
}

// The point with the least sum of squared distances to the optical axes, where it is well
// determined and in front of most cameras.
std::optional<Eigen::Vector3d> AxesCrossing(const std::vector<Viewpoint>& cameras,
                                            const Eigen::Vector3d& reference) {
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (const Viewpoint& camera : cameras) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - camera.forward * camera.forward.transpose();
    normal_matrix += across;
    right_side += across * (camera.center - reference);
  }
  // The least eigenvalue is the mean squared sine between the axes and the direction that they
  // share most: 1e-3 is a spread of 2 degrees.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal_matrix);
  if (!(solver.eigenvalues()[0] > 1e-3 * static_cast<double>(cameras.size()))) return std::nullopt;
  const Eigen::Vector3d crossing = reference + normal_matrix.ldlt().solve(right_side);
  const auto in_front = std::count_if(cameras.begin(), cameras.end(), [&](const Viewpoint& camera) {
    return camera.forward.dot(crossing - camera.center) > 0;
  });
  if (2 * in_front <= static_cast<std::ptrdiff_t>(cameras.size())) return std::nullopt;
  return crossing;
}

}  // namespace

Similarity NormalizedFrame(const std::vector<Viewpoint>& cameras,
                           const std::vector<Eigen::Vector3d>& points) {
  CHECK(!cameras.empty());
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(cameras.size());
  for (const Viewpoint& camera : cameras) centers.push_back(camera.center);
  std::vector<Eigen::Vector3d> finite;
  for (const Eigen::Vector3d& point : points) {
    if (point.allFinite()) finite.push_back(point);
  }

  Similarity result;
  if (!finite.empty()) {
    result.translation = MedianPoint(finite);
  } else {
    const Eigen::Vector3d center = MedianPoint(centers);
    result.translation = AxesCrossing(cameras, center).value_or(center);
  }
  const Eigen::Vector3d& origin = result.translation;
  double farthest_camera = 0;
  double largest_coordinate = origin.lpNorm<Eigen::Infinity>();
  for (const Eigen::Vector3d& center : centers) {
    farthest_camera = std::max(farthest_camera, (center - origin).stableNorm());
    largest_coordinate = std::max(largest_coordinate, center.lpNorm<Eigen::Infinity>());
  }
  double unit = std::max(MedianDistance(centers, origin), farthest_camera / (0.9 * kFarRadius));
  if (!finite.empty()) unit = std::max(unit, MedianDistance(finite, origin) / 3);
  // Below the rounding of the coordinates there is no extent to speak of.
  result.scale = unit > 1e-12 * largest_coordinate ? unit : 1;
  return result;
}

}  // namespace semfoam
