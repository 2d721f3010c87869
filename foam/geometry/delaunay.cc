// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/delaunay.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/nearest_cell.h"
#include "foam/util/freed_memory.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <bit>
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

// The cells around one cell, each once. An open-addressing table, a few cache lines for the usual
// fifteen.
class CellSet {
 public:
  // Empties it and makes room for `count` additions.
  void Reset(size_t count) {
    size_ = std::bit_ceil(2 * count);
    shift_ = 32 - std::countr_zero(size_);
    table_.assign(size_, kNoCell);
  }
  // Returns false if the cell is there already.
  bool Add(uint32_t cell) {
    // Fibonacci hashing: the product's high bits.
    size_t slot = cell * 0x9e3779b9u >> shift_;
    while (table_[slot] != kNoCell) {
      if (table_[slot] == cell) return false;
      slot = (slot + 1) & (size_ - 1);
    }
    table_[slot] = cell;
    return true;
  }

 private:
  std::vector<uint32_t> table_;
  size_t size_ = 0;
  int shift_ = 0;
};

// A cell's neighbours are the distinct other corners of the tetrahedra around it.
void BuildAdjacency(Delaunay* delaunay) {
  const auto& tets = delaunay->tets;
  const uint32_t num_cells = delaunay->num_cells;
  const TetsOfCells around = ListTetsOfCells(*delaunay);
  std::vector<uint8_t> on_hull(num_cells, 0);
  for (uint32_t t = 0; t < tets.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      if (delaunay->tet_neighbors[t][k] != kNoTet) continue;
      for (int c = 0; c < 4; ++c) on_hull[tets[t][c]] |= c != k;
    }
  }

  constexpr int64_t kBlock = 4096;
  const auto for_each_neighbor = [&](uint32_t cell, CellSet* met, auto&& visit) {
    const auto around_cell = around.Of(cell);
    met->Reset(3 * around_cell.size());
    for (const uint32_t t : around_cell) {
      for (const uint32_t other : tets[t]) {
        if (other != cell && met->Add(other)) visit(other);
      }
    }
  };
  auto& offsets = delaunay->offsets;
  offsets.assign(num_cells + 1, 0);
  ParallelForBlocks(num_cells, kBlock, [&](int64_t begin, int64_t end) {
    CellSet met;
    for (int64_t i = begin; i < end; ++i) {
      const size_t count = around.Of(i).size();
      if (on_hull[i]) {
        for_each_neighbor(i, &met, [&](uint32_t) { ++offsets[i + 1]; });
      } else if (count > 0) {
        // The tetrahedra around an inner site are the triangles of a sphere, the neighbours its
        // vertices: F = 2 V - 4.
        offsets[i + 1] = static_cast<uint32_t>(count / 2 + 2);
      }
    }
  });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  delaunay->neighbors.resize(offsets.back());
  ParallelForBlocks(num_cells, kBlock, [&](int64_t begin, int64_t end) {
    CellSet met;
    for (int64_t i = begin; i < end; ++i) {
      const auto first = delaunay->neighbors.begin() + offsets[i];
      const auto last = delaunay->neighbors.begin() + offsets[i + 1];
      auto next = first;
      for_each_neighbor(i, &met, [&](uint32_t other) {
        CHECK(next != last) << "more neighbours than a sphere of triangles has vertices";
        *next++ = other;
      });
      CHECK(next == last) << "fewer neighbours than a sphere of triangles has vertices";
      std::sort(first, last);
    }
  });
}

// Inserts the sites in an order that lies close together in space.
void Insert(const std::vector<Eigen::Vector3f>& cell_positions, Triangulation* triangulation) {
  std::vector<Kernel::Point_3> points = ToPoints(cell_positions);
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  CGAL::spatial_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(points)));

  Triangulation::Cell_handle hint;
  for (const size_t index : order) {
    const uint32_t i = static_cast<uint32_t>(index);
    const size_t before = triangulation->number_of_vertices();
    const Triangulation::Vertex_handle vertex = triangulation->insert(points[i], hint);
    if (triangulation->number_of_vertices() > before) {
      vertex->info() = i;
    } else {
      // Of sites at the same place, the lowest index owns the cell, whatever the order of
      // insertion.
      vertex->info() = std::min(vertex->info(), i);
    }
    hint = vertex->cell();
  }
}

// Sets tets and tet_neighbors. CGAL's triangulation, some 550 bytes a site, is gone on return.
void FindTets(const std::vector<Eigen::Vector3f>& cell_positions, Delaunay* delaunay) {
  Triangulation triangulation;
  Insert(cell_positions, &triangulation);
  CHECK_EQ(triangulation.dimension(), 3);

  // With CGAL's triangulation and ours, memory is at its peak: a list of the cells, to read them in
  // parallel, would be another tenth.
  uint32_t num_tets = 0;
  for (auto cell = triangulation.all_cells_begin(); cell != triangulation.all_cells_end(); ++cell) {
    cell->info() = triangulation.is_infinite(cell) ? kNoTet : num_tets++;
  }
  delaunay->tets.reserve(num_tets);
  delaunay->tet_neighbors.reserve(num_tets);
  for (auto cell = triangulation.all_cells_begin(); cell != triangulation.all_cells_end(); ++cell) {
    if (cell->info() == kNoTet) continue;
    auto& tet = delaunay->tets.emplace_back();
    auto& neighbors = delaunay->tet_neighbors.emplace_back();
    for (int k = 0; k < 4; ++k) {
      tet[k] = cell->vertex(k)->info();
      neighbors[k] = cell->neighbor(k)->info();
    }
  }
}

}  // namespace

Delaunay Triangulate(const std::vector<Eigen::Vector3f>& cell_positions) {
  CHECK_GE(cell_positions.size(), kNumGuardSites);
  CHECK_LT(cell_positions.size(), kNoTet);
  Delaunay delaunay;
  delaunay.num_cells = static_cast<uint32_t>(cell_positions.size());
  delaunay.num_sites = delaunay.num_cells - kNumGuardSites;
  FindTets(cell_positions, &delaunay);
  // What CGAL's triangulation has left.
  ReturnFreedMemory();
  BuildAdjacency(&delaunay);
  return delaunay;
}

TetsOfCells ListTetsOfCells(const Delaunay& delaunay) {
  TetsOfCells list;
  list.offsets.assign(delaunay.num_cells + 1, 0);
  for (const auto& tet : delaunay.tets) {
    for (const uint32_t cell : tet) ++list.offsets[cell + 1];
  }
  std::partial_sum(list.offsets.begin(), list.offsets.end(), list.offsets.begin());
  list.tets.resize(list.offsets.back());
  std::vector<uint32_t> fill(list.offsets.begin(), list.offsets.end() - 1);
  for (uint32_t t = 0; t < delaunay.tets.size(); ++t) {
    for (const uint32_t cell : delaunay.tets[t]) list.tets[fill[cell]++] = t;
  }
  return list;
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
  // An empty cell (a duplicate site) has no way out; a guard always has.
  return DescendToNearestCell(
      query,
      delaunay.Neighbors(start).empty() ? delaunay.num_sites : start,
      [&](uint32_t cell) { return cell_positions[cell]; },
      [&](uint32_t cell, const auto& visit) {
        for (const uint32_t neighbor : delaunay.Neighbors(cell)) visit(neighbor);
      });
}

}  // namespace semfoam
