// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/mesh_distance.h"

#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>
#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

using NeighborSearch = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Kernel>>;

constexpr int64_t kPointsPerBlock = 1024;
constexpr uint64_t kPurpose = 0x6d657368;  // of the random numbers; no other part draws these

Kernel::Point_3 ToPoint(const Eigen::Vector3d& x) { return {x.x(), x.y(), x.z()}; }

double Area(const TriangleMesh& mesh, const std::array<uint32_t, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  return 0.5 *
         (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
}

}  // namespace

std::vector<Eigen::Vector3d> SampleSurface(const TriangleMesh& mesh, int64_t count) {
  std::vector<double> area_up_to;
  area_up_to.reserve(mesh.triangles.size());
  double area = 0;
  for (const auto& triangle : mesh.triangles) area_up_to.push_back(area += Area(mesh, triangle));
  CHECK_GT(area, 0);
  std::vector<Eigen::Vector3d> points(count);
  ParallelForBlocks(count, kPointsPerBlock, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      CounterRandom random(0, kPurpose, static_cast<uint64_t>(k));
      const double at =
          area * (static_cast<double>(k) + random.Uniform()) / static_cast<double>(count);
      const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end() - 1, at);
      const auto& [a, b, c] = mesh.triangles[found - area_up_to.begin()];
      double u = random.Uniform(), v = random.Uniform();
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      points[k] = mesh.vertices[a] + u * (mesh.vertices[b] - mesh.vertices[a]) +
                  v * (mesh.vertices[c] - mesh.vertices[a]);
    }
  });
  return points;
}

std::vector<double> DistancesToPoints(const std::vector<Eigen::Vector3d>& points,
                                      const std::vector<Eigen::Vector3d>& queries) {
  CHECK(!points.empty());
  const Eigen::Vector3d& origin = points.front();
  const auto to_point = [&](const Eigen::Vector3d& x) { return ToPoint(x - origin); };
  std::vector<Kernel::Point_3> local;
  local.reserve(points.size());
  for (const Eigen::Vector3d& point : points) local.push_back(to_point(point));
  NeighborSearch::Tree tree(local.begin(), local.end());
  tree.build();
  std::vector<double> distances(queries.size());
  ParallelForBlocks(std::ssize(queries), kPointsPerBlock, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      const NeighborSearch search(tree, to_point(queries[k]), 1);
      distances[k] = std::sqrt(search.begin()->second);
    }
  });
  return distances;
}

std::vector<double> DistancesToSurface(const TriangleMesh& mesh,
                                       const std::vector<Eigen::Vector3d>& points) {
  // Near the origin, so that georeferenced coordinates cost nothing.
  const Eigen::Vector3d& origin = mesh.vertices[mesh.triangles.front()[0]];
  const auto to_point = [&](const Eigen::Vector3d& x) { return ToPoint(x - origin); };
  Triangles triangles;
  for (const auto& triangle : mesh.triangles) {
    // Its neighbours hold what a triangle without area holds; it has no plane to project onto.
    if (!(Area(mesh, triangle) > 0)) continue;
    triangles.emplace_back(to_point(mesh.vertices[triangle[0]]),
                           to_point(mesh.vertices[triangle[1]]),
                           to_point(mesh.vertices[triangle[2]]));
  }
  CHECK(!triangles.empty());
  Tree tree(triangles.begin(), triangles.end());
  tree.build();
  tree.accelerate_distance_queries();
  // The first query makes what all others only read.
  tree.closest_point(triangles.front().vertex(0));
  std::vector<double> distances(points.size());
  ParallelForBlocks(std::ssize(points), kPointsPerBlock, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      distances[k] = std::sqrt(tree.squared_distance(to_point(points[k])));
      CHECK(std::isfinite(distances[k]));
    }
  });
  return distances;
}

}  // namespace semfoam
