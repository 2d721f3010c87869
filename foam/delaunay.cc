// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/delaunay.h"

#include "foam/guard_sites.h"
#include "foam/parallel.h"

#include <algorithm>
#include <numeric>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/hilbert_sort.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<uint32_t,
                                              Kernel,
                                              CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Triangulation =
    CGAL::Delaunay_triangulation_3<Kernel,
                                   CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;
using PointMap = CGAL::Pointer_property_map<Kernel::Point_3>::type;
using SortTraits = CGAL::Spatial_sort_traits_adapter_3<Kernel, PointMap>;

std::vector<Kernel::Point_3> ToPoints(const std::vector<Eigen::Vector3f>& positions) {
  std::vector<Kernel::Point_3> points;
  points.reserve(positions.size());
  for (const Eigen::Vector3f& p : positions) {
    CHECK(p.allFinite()) << "a site is not finite";
    points.emplace_back(p.x(), p.y(), p.z());
  }
  return points;
}

// Vertex -> tetrahedra, then the distinct other corners of those, sorted.
void BuildAdjacency(Delaunay* delaunay) {
  const auto& tets = delaunay->tets;
  const uint32_t num_cells = delaunay->num_cells;
  std::vector<uint32_t> first(num_cells + 1, 0);
  for (const auto& tet : tets) {
    for (const uint32_t v : tet) ++first[v + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<uint32_t> incident(first.back());
  std::vector<uint32_t> fill(first.begin(), first.end() - 1);
  for (uint32_t t = 0; t < tets.size(); ++t) {
    for (const uint32_t v : tets[t]) incident[fill[v]++] = t;
  }

  constexpr int64_t kBlock = 4096;
  std::vector<std::vector<uint32_t>> block_neighbors((num_cells + kBlock - 1) / kBlock);
  delaunay->offsets.assign(num_cells + 1, 0);
  ParallelForBlocks(num_cells, kBlock, [&](int64_t begin, int64_t end) {
    std::vector<uint32_t>& out = block_neighbors[begin / kBlock];
    std::vector<uint32_t> around;
    for (int64_t v = begin; v < end; ++v) {
      around.clear();
      // Each neighbour turns up once per tetrahedron on the shared edge; a linear search of some
      // fifteen entries is cheaper than sorting eighty. But a guard can have every site for a
      // neighbour.
      const bool few = first[v + 1] - first[v] < 256;
      for (uint32_t k = first[v]; k < first[v + 1]; ++k) {
        for (const uint32_t w : tets[incident[k]]) {
          if (w == v) continue;
          if (few && std::find(around.begin(), around.end(), w) != around.end()) continue;
          around.push_back(w);
        }
      }
      std::sort(around.begin(), around.end());
      around.erase(std::unique(around.begin(), around.end()), around.end());
      delaunay->offsets[v + 1] = static_cast<uint32_t>(around.size());
      out.insert(out.end(), around.begin(), around.end());
    }
  });
  std::partial_sum(delaunay->offsets.begin(), delaunay->offsets.end(), delaunay->offsets.begin());
  delaunay->neighbors.clear();
  delaunay->neighbors.reserve(delaunay->offsets.back());
  for (const auto& part : block_neighbors) {
    delaunay->neighbors.insert(delaunay->neighbors.end(), part.begin(), part.end());
  }
}

}  // namespace

Delaunay Triangulate(const std::vector<Eigen::Vector3f>& cell_positions) {
  CHECK_GE(cell_positions.size(), kNumGuardSites);
  CHECK_LT(cell_positions.size(), kNoTet);
  Delaunay delaunay;
  delaunay.num_cells = static_cast<uint32_t>(cell_positions.size());
  delaunay.num_sites = delaunay.num_cells - kNumGuardSites;

  std::vector<Kernel::Point_3> points = ToPoints(cell_positions);
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  CGAL::spatial_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(points)));

  Triangulation triangulation;
  Triangulation::Cell_handle hint;
  for (const size_t index : order) {
    const uint32_t i = static_cast<uint32_t>(index);
    const size_t before = triangulation.number_of_vertices();
    const Triangulation::Vertex_handle vertex = triangulation.insert(points[i], hint);
    if (triangulation.number_of_vertices() > before) {
      vertex->info() = i;
    } else {
      // Of sites at the same place, the lowest index owns the cell, whatever the order of
      // insertion.
      vertex->info() = std::min(vertex->info(), i);
    }
    hint = vertex->cell();
  }
  CHECK_EQ(triangulation.dimension(), 3);

  delaunay.tets.reserve(triangulation.number_of_finite_cells());
  for (auto cell = triangulation.finite_cells_begin(); cell != triangulation.finite_cells_end();
       ++cell) {
    cell->info() = static_cast<uint32_t>(delaunay.tets.size());
    delaunay.tets.push_back({cell->vertex(0)->info(),
                             cell->vertex(1)->info(),
                             cell->vertex(2)->info(),
                             cell->vertex(3)->info()});
  }
  delaunay.tet_neighbors.reserve(delaunay.tets.size());
  for (auto cell = triangulation.finite_cells_begin(); cell != triangulation.finite_cells_end();
       ++cell) {
    std::array<uint32_t, 4>& across = delaunay.tet_neighbors.emplace_back();
    for (int k = 0; k < 4; ++k) {
      const Triangulation::Cell_handle other = cell->neighbor(k);
      across[k] = triangulation.is_infinite(other) ? kNoTet : other->info();
    }
  }
  BuildAdjacency(&delaunay);
  return delaunay;
}

std::vector<uint32_t> HilbertOrder(const std::vector<Eigen::Vector3f>& sites) {
  std::vector<Kernel::Point_3> points = ToPoints(sites);
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  CGAL::hilbert_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(points)));
  return {order.begin(), order.end()};
}

uint32_t NearestCell(const std::vector<Eigen::Vector3f>& cell_positions,
                     const Delaunay& delaunay,
                     const Eigen::Vector3d& query,
                     uint32_t start) {
  const auto squared_distance = [&](uint32_t cell) {
    return (cell_positions[cell].cast<double>() - query).squaredNorm();
  };
  // An empty cell (a duplicate site) has no way out; a guard always has.
  uint32_t cell = delaunay.Neighbors(start).empty() ? delaunay.num_sites : start;
  double nearest = squared_distance(cell);
  while (true) {
    uint32_t better = cell;
    for (const uint32_t neighbor : delaunay.Neighbors(cell)) {
      const double distance = squared_distance(neighbor);
      if (distance < nearest) {
        nearest = distance;
        better = neighbor;
      }
    }
    if (better == cell) return cell;
    cell = better;
  }
}

}  // namespace semfoam
