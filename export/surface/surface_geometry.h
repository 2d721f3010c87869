// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/surface/surface_smoothing.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Returns the triangles that intersect another one elsewhere than in shared corners and sides,
// ascending, by exact predicates (CGAL); a triangle without area counts where it touches another
// one. `triangles` must be a closed 2-manifold (CHECK).
std::vector<uint32_t> SelfIntersections(const std::vector<Eigen::Vector3d>& positions,
                                        const Triangles& triangles);

// Distance of one surface from another, in the unit of the positions.
struct SurfaceDistance {
  // Mean over the area of the first surface, and maximum.
  double mean = 0;
  double max = 0;
};

// Measures the distance from points of the first surface, 20 000 evenly over its area and all of
// its vertices (these only for the maximum), to the nearest point of the second. The mean of a
// first surface without area is 0. The result is the same on any number of threads. Both surfaces
// must have triangles (CHECK).
SurfaceDistance DistanceTo(const std::vector<Eigen::Vector3d>& from_positions,
                           const Triangles& from_triangles,
                           const std::vector<Eigen::Vector3d>& to_positions,
                           const Triangles& to_triangles);

}  // namespace semfoam
