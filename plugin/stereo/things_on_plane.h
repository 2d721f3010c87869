// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/level_plane.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

struct PointSpread {
  // By coordinates.
  Eigen::Vector3d middle;
  // Within this distance of it lie 80 % of the points.
  double radius = 0;
};

// Returns where the points lie. CHECKs that there are some.
PointSpread SpreadOf(const std::vector<Eigen::Vector3f>& points);

// Where things stand on a plane: the convex hulls of heaps of points above it, seen from above, in
// squares of a twentieth of the points' spread, and one square around them. A plain thing has
// points at its edges alone, and what lies between them belongs to it.
class ThingsOnPlane {
 public:
  // Points within 2 % of their spread above the plane are on it. `points` are in the normalised
  // frame, not empty.
  ThingsOnPlane(const LevelPlane& plane, const std::vector<Eigen::Vector3f>& points);

  // Returns whether a point of the plane lies under a thing.
  bool IsUnderThing(const Eigen::Vector3d& x) const;
  // Returns the distance along the plane from the middle of the points.
  double DistanceFromMiddle(const Eigen::Vector3d& x) const;

 private:
  // A square, by the numbers of its column and row from the middle.
  using Square = Eigen::Vector2i;

  Eigen::Vector2d OnPlane(const Eigen::Vector3d& x) const;
  size_t IndexOf(const Square& square) const;
  // Sets all squares of the convex hull of some, and those around it.
  void CoverHull(const std::vector<Square>& squares);

  Eigen::Vector3d middle_, column_axis_, row_axis_;
  double edge_ = 1;
  std::vector<uint8_t> is_covered_;
};

}  // namespace semfoam
