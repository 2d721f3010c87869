// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A surface cut into charts, each of which is laid out in the plane.
struct UvCharts {
  // [triangles]
  std::vector<uint32_t> chart_of;
  // [charts] Size of the chart's layout, which begins at (0, 0), in the unit of the vertices.
  std::vector<Eigen::Vector2d> sizes;

  // A point for each chart and vertex of it: its place in the layout of its chart, and the vertex.
  std::vector<Eigen::Vector2d> points;
  std::vector<uint32_t> vertex_of;
  // [triangles] The points at the corners.
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Cuts a surface into charts that are nearly flat, and projects each along its mean normal.
//
// Faces are joined into charts one pair after the other (hierarchical clustering over the edges):
// first those that add the least to the sum over faces of area * (1 - cosine between the normal and
// the mean normal of the chart) and to the charts' outlines, as long as the mean of 1 - cosine
// stays below 0.2, the value of a spherical cap of 53 degrees. Normals are smoothed before, so that
// a rough surface is not cut at each bump. Charts with less than a thousandth of the area join a
// neighbour even beyond that.
//
// Where a projection covers itself with parts of the chart that are not neighbours (a spiral), the
// parts below become charts of their own. Triangles that are turned away from the direction of
// projection may overlap their neighbours; they are as small as the surface is rough.
//
// The scale is that of the surface, reduced by the cosine where it is tilted. Each layout is turned
// so that its box has the least area (in steps of 5 degrees). The same result on any number of
// threads.
UvCharts MakeUvCharts(std::span<const Eigen::Vector3d> vertices,
                      std::span<const std::array<uint32_t, 3>> triangles);

}  // namespace semfoam
