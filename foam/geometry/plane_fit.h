// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Points of surfaces, such as the cells of a floor or the points of a COLMAP model, any frame.
struct SurfaceSamples {
  std::vector<Eigen::Vector3d> points;
  // [points] Weights >= 0, such as areas.
  std::vector<double> weights;
  // Distance up to which points are near a plane, > 0; about twice their noise.
  double tolerance = 0;
  // Number of points, drawn by weight, that choose among planes, > 0. The time grows with it.
  size_t num_judges = 4000;
};

// A plane that passes through many of the samples.
struct PlaneFit {
  // Unit length, of either sign.
  Eigen::Vector3d normal;
  // The middle of the inliers, on the plane.
  Eigen::Vector3d point;
  // Root mean square distance of the inliers from the plane, by weight.
  double rms = 0;
  // Share of the samples within the tolerance, by weight, 0..1.
  double share = 0;
};

// A direction that the normal of a plane must be near to, up to its sign.
struct NormalLimit {
  // Unit length.
  Eigen::Vector3d direction;
  // 0..90.
  double max_degrees = 90;
};

// Fits the plane with the largest weight of samples near it. Draws 4000 planes through three
// samples each, chooses the one with the smallest sum of squared distances, each at most the
// tolerance's (MSAC: Torr and Zisserman 2000), and fits it by least squares to the samples near it,
// of which those beyond 2.5 standard deviations (by the median) are left out. Draws are seeded and
// the sums serial, so the result depends on the input alone. Coordinates may have any offset.
//
// Returns nothing where less than three samples have a weight, where they lie on one line, and
// where no plane satisfies the limit. CHECKs the sizes and the tolerance.
std::optional<PlaneFit> FitPlane(const SurfaceSamples& samples,
                                 const std::optional<NormalLimit>& limit = std::nullopt);

}  // namespace semfoam
