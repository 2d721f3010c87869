// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/training_topology.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/render/total_variation.h"
#include "foam/util/parallel.h"

#include <algorithm>

namespace semfoam {
namespace {

// Returns whether a good part of the cell lies in free space: of the points most of the way from
// the site to the planes of its faces, a quarter. Sites have no neighbours within large cells, so
// that one whose site lies beside a view may hang before the camera all the same.
bool ReachesInto(const FreeSpace& free_space,
                 const std::vector<Eigen::Vector3f>& sites,
                 const Delaunay& delaunay,
                 uint32_t cell) {
  constexpr float kHowFar = 0.4f;  // of the way to the neighbour, on which the plane is half-way
  int inside = 0, count = 0;
  for (const uint32_t j : delaunay.Neighbors(cell)) {
    if (j >= delaunay.num_sites) continue;
    ++count;
    inside += free_space.Contains(sites[cell] + kHowFar * (sites[j] - sites[cell]));
  }
  return inside > 0 && 4 * inside >= count;
}

}  // namespace

void TrainingTopology::Triangulate(const std::vector<Eigen::Vector3f>& sites,
                                   const FreeSpace& free_space,
                                   bool with_areas) {
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(sites);
  // The old topology is freed before the new one is made, and tetrahedra are only needed for areas.
  delaunay_ = {};
  tv_weights_ = {};
  triangulated_ = sites;
  delaunay_ = semfoam::Triangulate(cells);
  if (with_areas) {
    tv_weights_ = TotalVariationWeights(
        delaunay_, FaceAreas(cells, delaunay_, VoronoiVertices(cells, delaunay_)));
  }
  const std::vector<float> radii = CellRadii(cells, delaunay_);
  step_lengths_.resize(sites.size());
  ParallelForBlocks(sites.size(), 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto neighbors = delaunay_.Neighbors(i);
      // Guards have the highest indices.
      const bool is_open = !neighbors.empty() && neighbors.back() >= delaunay_.num_sites;
      step_lengths_[i] = StepLengthsOf(radii[i], is_open);
    }
  });
  delaunay_.tets = {};
  delaunay_.tet_neighbors = {};
  SetTopology(delaunay_, &geometry_);
  is_clear_.assign(sites.size(), 0);
  ParallelForBlocks(sites.size(), 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      is_clear_[i] = !IsSkySite(sites[i]) &&
                     (free_space.Contains(sites[i]) ||
                      (radii[i] > kLargeCell &&
                       ReachesInto(free_space, sites, delaunay_, static_cast<uint32_t>(i))));
    }
  });
  RefreshPlanes(sites);
}

uint32_t TrainingTopology::CellAt(const Eigen::Vector3d& origin, uint32_t from) const {
  return NearestCell(
      geometry_.positions, delaunay_, origin, std::min(from, delaunay_.num_cells - 1));
}

}  // namespace semfoam
