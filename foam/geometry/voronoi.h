// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Computes the Voronoi vertices: the circumcentre of every tetrahedron, [delaunay.tets.size()],
// normalised frame. The circumcentre of a sliver can lie far away; it is clamped to the sphere of
// radius 2 * kGuardRadius, and is always finite.
std::vector<Eigen::Vector3d> VoronoiVertices(const std::vector<Eigen::Vector3f>& cell_positions,
                                             const Delaunay& delaunay);

// Computes the area of the Voronoi face of every directed edge, aligned with delaunay.neighbors
// (both directions hold the same value); >= 0, 0 for the unbounded faces between guards. Normalised
// frame, squared units.
std::vector<double> FaceAreas(const std::vector<Eigen::Vector3f>& cell_positions,
                              const Delaunay& delaunay,
                              const std::vector<Eigen::Vector3d>& voronoi_vertices);

// Computes the volume of every real cell, [num_sites]: the sum of its faces' pyramids, area * |p_j
// - p_i| / 6.
std::vector<double> CellVolumes(const std::vector<Eigen::Vector3f>& cell_positions,
                                const Delaunay& delaunay,
                                const std::vector<double>& face_areas);

// Computes the radius of every real cell, [num_sites]: the mean over its neighbours, guards left
// out, of half the distance (Radiant Foam's cell radius, used as a weight in its densification). 0
// for a cell without real neighbours.
std::vector<float> CellRadii(const std::vector<Eigen::Vector3f>& cell_positions,
                             const Delaunay& delaunay);

}  // namespace semfoam
