// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/segment/surface_graph.h"

#include <cstdint>
#include <unordered_set>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A plane that a connected part of the surface lies in, such as a table top, a floor, a wall.
struct DominantPlane {
  // Unit length, out of the matter, and a point of the plane; normalised frame.
  Eigen::Vector3f normal;
  Eigen::Vector3f point;
  // Median radius of its cells.
  float radius = 0;
  // Nodes of the graph, ascending.
  std::vector<uint32_t> nodes;

  float Height(const Eigen::Vector3f& x) const { return (x - point).dot(normal); }
};

// Finds planes that hold at least `least_share` of what photos show (SurfaceGraph::weights), the
// largest first, and connected parts of the same plane that hold three tenths of `least_share` and
// a twentieth of the largest part. No node is in two planes.
//
// Of 400 planes through nodes with their normals, spread evenly over what photos show, takes the
// one with the most weight near it (within two radii of the cell, its normal within 45 degrees),
// fits it by least squares, and keeps its connected parts; then looks on in what is left. So the
// cap of a ball, up to four radii high, is a plane where it is `least_share` of the scene: cells of
// a ball alone are too large for their shape to show if their radius is above least_share / 2 of
// that of the ball. Sums run in a fixed order: the result depends on the input alone. CHECKs that
// `least_share` is positive.
std::vector<DominantPlane> FindDominantPlanes(const SurfaceGraph& graph, double least_share);

// Where a plane's cells lie in it: a raster of squares of four radii that hold one.
class PlaneFootprint {
 public:
  PlaneFootprint(const SurfaceGraph& graph, const DominantPlane& plane);
  // Returns whether one of the squares around that below `x` is occupied, `rings` to each side.
  bool IsAt(const Eigen::Vector3f& x, int rings) const;

 private:
  // The square of a point, as one number.
  int64_t KeyOf(const Eigen::Vector3f& x, int column_offset, int row_offset) const;

  Eigen::Vector3f point_;
  Eigen::Vector3f column_axis_, row_axis_;
  float edge_ = 1;
  std::unordered_set<int64_t> occupied_;
};

}  // namespace semfoam
