// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/voronoi.h"

#include "foam/geometry/guard_sites.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

constexpr int64_t kBlock = 4096;

Eigen::Vector3d Circumcenter(const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& b,
                             const Eigen::Vector3d& c,
                             const Eigen::Vector3d& d) {
  // Corners relative to the first one, so that nothing cancels far from the frame's origin.
  const Eigen::Vector3d cd = c.cross(d);
  const double six_volume = b.dot(cd);
  const Eigen::Vector3d numerator =
      b.squaredNorm() * cd + c.squaredNorm() * d.cross(b) + d.squaredNorm() * b.cross(c);
  const Eigen::Vector3d center = origin + numerator / (2 * six_volume);
  if (!center.allFinite()) {
    // Flat to the last bit: the true centre is farther away than doubles can represent, in the
    // direction of the flat side's normal.
    const double length = numerator.norm();
    const Eigen::Vector3d direction =
        length > 0 ? Eigen::Vector3d(numerator / length) : Eigen::Vector3d::UnitX();
    return 2 * kGuardRadius * direction;
  }
  const double distance = center.norm();
  return distance > 2 * kGuardRadius ? Eigen::Vector3d(center * (2 * kGuardRadius / distance))
                                     : center;
}

// Is (a, b, c, d) an even permutation of 0, 1, 2, 3?
constexpr bool IsEvenPermutation(int a, int b, int c, int d) {
  return ((a > b) + (a > c) + (a > d) + (b > c) + (b > d) + (c > d)) % 2 == 0;
}

size_t EdgeIndex(const Delaunay& delaunay, uint32_t from, uint32_t to) {
  const auto begin = delaunay.neighbors.begin() + delaunay.offsets[from];
  const auto end = delaunay.neighbors.begin() + delaunay.offsets[from + 1];
  return std::lower_bound(begin, end, to) - delaunay.neighbors.begin();
}

// Copies the area of each edge from its lower cell, a real one, to its higher cell.
void CopyToHigherCells(const Delaunay& delaunay, std::vector<double>* areas) {
  ParallelForBlocks(delaunay.num_cells, kBlock, [&](int64_t begin, int64_t end) {
    for (uint32_t i = begin; i < end; ++i) {
      for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
        const uint32_t j = delaunay.neighbors[e];
        if (j < i && j < delaunay.num_sites) (*areas)[e] = (*areas)[EdgeIndex(delaunay, j, i)];
      }
    }
  });
}

}  // namespace

std::vector<Eigen::Vector3d> VoronoiVertices(const std::vector<Eigen::Vector3f>& cell_positions,
                                             const Delaunay& delaunay) {
  std::vector<Eigen::Vector3d> centers(delaunay.tets.size());
  ParallelForBlocks(centers.size(), kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t t = begin; t < end; ++t) {
      const auto& tet = delaunay.tets[t];
      const Eigen::Vector3d a = cell_positions[tet[0]].cast<double>();
      centers[t] = Circumcenter(a,
                                cell_positions[tet[1]].cast<double>() - a,
                                cell_positions[tet[2]].cast<double>() - a,
                                cell_positions[tet[3]].cast<double>() - a);
    }
  });
  return centers;
}

std::vector<double> FaceAreas(const std::vector<Eigen::Vector3f>& cell_positions,
                              const Delaunay& delaunay,
                              const std::vector<Eigen::Vector3d>& voronoi_vertices) {
  // The face of edge (i, j) is the polygon of the circumcentres around it. Its area is a sum over
  // the facets on that edge: each facet joins two consecutive corners, and adds the signed triangle
  // that they span with the edge's midpoint, which lies in the face's plane. So no tetrahedron
  // needs to know its place around the edge.
  std::vector<double> areas(delaunay.neighbors.size(), 0.0);
  const TetsOfCells around = ListTetsOfCells(delaunay);
  struct Edge {
    Eigen::Vector3d middle;
    Eigen::Vector3d direction;
  };
  // An edge is summed up by its lower cell, over facets in the order of their lower tetrahedra.
  ParallelForBlocks(delaunay.num_sites, kBlock, [&](int64_t block_begin, int64_t block_end) {
    std::vector<Edge> edges;
    // edge_to[j]: index in `edges` of the one to j. Set for the neighbours of the cell at hand.
    const auto edge_to = std::make_unique_for_overwrite<uint32_t[]>(delaunay.num_cells);
    for (uint32_t i = block_begin; i < block_end; ++i) {
      const auto neighbors = delaunay.Neighbors(i);
      const auto first = std::upper_bound(neighbors.begin(), neighbors.end(), i);
      double* const area = &areas[delaunay.offsets[i] + (first - neighbors.begin())];
      edges.clear();
      const Eigen::Vector3d p = cell_positions[i].cast<double>();
      for (auto j = first; j != neighbors.end(); ++j) {
        const Eigen::Vector3d q = cell_positions[*j].cast<double>();
        edge_to[*j] = static_cast<uint32_t>(edges.size());
        edges.push_back({0.5 * (p + q), (q - p).normalized()});
      }
      if (edges.empty()) continue;
      for (const uint32_t t : around.Of(i)) {
        const auto& tet = delaunay.tets[t];
        const int own = static_cast<int>(std::find(tet.begin(), tet.end(), i) - tet.begin());
        for (int k = 0; k < 4; ++k) {
          const uint32_t across = delaunay.tet_neighbors[t][k];
          if (k == own || across == kNoTet || across < t) continue;
          for (int l = 0; l < 4; ++l) {
            const int j = 6 - own - k - l;  // the four corners are 0, 1, 2 and 3
            if (l == k || l == own || tet[j] < i) continue;
            // Around the axis i -> j, k lies counter-clockwise of l where the permutation is even.
            const uint32_t e = edge_to[tet[j]];
            const Eigen::Vector3d& middle = edges[e].middle;
            const double triangle = 0.5 * (voronoi_vertices[across] - middle)
                                              .cross(voronoi_vertices[t] - middle)
                                              .dot(edges[e].direction);
            area[e] += IsEvenPermutation(own, j, l, k) ? triangle : -triangle;
          }
        }
      }
      for (size_t e = 0; e < edges.size(); ++e) area[e] = std::max(area[e], 0.0);
    }
  });
  CopyToHigherCells(delaunay, &areas);
  return areas;
}

std::vector<double> CellVolumes(const std::vector<Eigen::Vector3f>& cell_positions,
                                const Delaunay& delaunay,
                                const std::vector<double>& face_areas) {
  std::vector<double> volumes(delaunay.num_sites, 0.0);
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
      const double length =
          (cell_positions[delaunay.neighbors[e]].cast<double>() - cell_positions[i].cast<double>())
              .norm();
      volumes[i] += face_areas[e] * length / 6;
    }
  }
  return volumes;
}

std::vector<float> CellRadii(const std::vector<Eigen::Vector3f>& cell_positions,
                             const Delaunay& delaunay) {
  std::vector<float> radii(delaunay.num_sites, 0.f);
  ParallelForBlocks(delaunay.num_sites, kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      float sum = 0;
      int count = 0;
      for (const uint32_t j : delaunay.Neighbors(i)) {
        if (j >= delaunay.num_sites) continue;
        sum += (cell_positions[j] - cell_positions[i]).norm();
        ++count;
      }
      radii[i] = count > 0 ? 0.5f * sum / count : 0.f;
    }
  });
  return radii;
}

}  // namespace semfoam
