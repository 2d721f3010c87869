// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/surface/surface_smoothing.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The triangles that meet another one elsewhere than in the corners and sides that they share,
// ascending, by exact predicates (CGAL); a triangle without area counts where it touches.
// `triangles` must be a closed 2-manifold (CHECK).
std::vector<uint32_t> SelfIntersections(const std::vector<Eigen::Vector3d>& positions,
                                        const Triangles& triangles);

// How far one surface is from another, in the unit of the positions.
struct SurfaceDistance {
  double mean = 0;  // over the area of the first
  double max = 0;
};

// From points of the first surface, 20 000 evenly over its area and all of its vertices (these for
// the maximum alone), to the nearest point of the second. A first surface without area has the mean
// 0. Same input, same result on any number of
// threads. Both must have triangles (CHECK).
SurfaceDistance DistanceTo(const std::vector<Eigen::Vector3d>& from_positions,
                           const Triangles& from_triangles,
                           const std::vector<Eigen::Vector3d>& to_positions,
                           const Triangles& to_triangles);

}  // namespace semfoam
