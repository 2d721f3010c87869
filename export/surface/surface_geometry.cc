// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_geometry.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

using DistanceKernel = CGAL::Simple_cartesian<double>;
using DistanceTriangles = std::vector<DistanceKernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<DistanceKernel, DistanceTriangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<DistanceKernel, Primitive>>;

constexpr int kNumSamples = 20000;
constexpr int64_t kBlock = 512;

// Points at equal steps of the area, so that a triangle has its share of them; within a triangle
// they follow Roberts' sequence R2, folded onto the triangle.
std::vector<Vector3d> EvenSamples(const std::vector<Vector3d>& positions,
                                  const Triangles& triangles) {
  std::vector<double> area_before(triangles.size() + 1, 0);
  for (size_t f = 0; f < triangles.size(); ++f) {
    const auto& [a, b, c] = triangles[f];
    const Vector3d cross = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    area_before[f + 1] = area_before[f] + cross.norm() / 2;
  }
  std::vector<Vector3d> samples;
  if (!(area_before.back() > 0)) return samples;
  size_t f = 0;
  for (int k = 0; k < kNumSamples; ++k) {
    const double area = (k + 0.5) / kNumSamples * area_before.back();
    while (f + 1 < triangles.size() && area_before[f + 1] < area) ++f;
    double u = std::fmod(k * 0.7548776662466927, 1.0);
    double v = std::fmod(k * 0.5698402909980532, 1.0);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto& [a, b, c] = triangles[f];
    samples.push_back(positions[a] + u * (positions[b] - positions[a]) +
                      v * (positions[c] - positions[a]));
  }
  return samples;
}

DistanceKernel::Point_3 ToPoint(const Vector3d& x) { return {x.x(), x.y(), x.z()}; }

std::vector<double> Distances(const Tree& tree, const std::vector<Vector3d>& points) {
  std::vector<double> distances(points.size());
  ParallelForBlocks(static_cast<int64_t>(points.size()), kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      distances[i] = std::sqrt(tree.squared_distance(ToPoint(points[i])));
    }
  });
  return distances;
}

}  // namespace

std::vector<uint32_t> SelfIntersections(const std::vector<Vector3d>& positions,
                                        const Triangles& triangles) {
  using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
  using Mesh = CGAL::Surface_mesh<Point>;
  Mesh mesh;
  mesh.reserve(positions.size(), triangles.size() * 3 / 2, triangles.size());
  for (const Vector3d& x : positions) mesh.add_vertex(Point(x.x(), x.y(), x.z()));
  for (const auto& [a, b, c] : triangles) {
    const auto face =
        mesh.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c));
    CHECK(face != Mesh::null_face()) << "the surface is not manifold";
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections<CGAL::Sequential_tag>(
      mesh, std::back_inserter(pairs));
  std::vector<uint32_t> faces;
  for (const auto& [a, b] : pairs) {
    faces.push_back(a);
    faces.push_back(b);
  }
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  return faces;
}

SurfaceDistance DistanceTo(const std::vector<Vector3d>& from_positions,
                           const Triangles& from_triangles,
                           const std::vector<Vector3d>& to_positions,
                           const Triangles& to_triangles) {
  CHECK(!from_triangles.empty() && !to_triangles.empty());
  DistanceTriangles to;
  to.reserve(to_triangles.size());
  for (const auto& [a, b, c] : to_triangles) {
    to.emplace_back(ToPoint(to_positions[a]), ToPoint(to_positions[b]), ToPoint(to_positions[c]));
  }
  Tree tree(to.cbegin(), to.cend());
  // Both at once, so that queries from several threads only read.
  tree.build();
  tree.accelerate_distance_queries();

  SurfaceDistance result;
  const std::vector<double> of_samples =
      Distances(tree, EvenSamples(from_positions, from_triangles));
  for (const double distance : of_samples) {
    result.mean += distance / static_cast<double>(of_samples.size());
    result.max = std::max(result.max, distance);
  }
  for (const double distance : Distances(tree, from_positions)) {
    result.max = std::max(result.max, distance);
  }
  return result;
}

}  // namespace semfoam
