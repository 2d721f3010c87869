// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"

#include <cstdint>

#include <Eigen/Core>

namespace semfoam {

// Returns the cell whose site is nearest to `query` (ties: the one found first), by greedy descent
// over the Delaunay graph from `start_cell`, which must have neighbours. The graph has no local
// minima, so the descent reaches the nearest site. `position(cell)` returns the site of a cell;
// `visit_neighbors(cell, visit)` calls visit(neighbour) for each of its neighbours.
template <typename Position, typename VisitNeighbors>
SEMFOAM_HOST_DEVICE uint32_t DescendToNearestCell(const Eigen::Vector3d& query,
                                                  uint32_t start_cell,
                                                  const Position& position,
                                                  const VisitNeighbors& visit_neighbors) {
  const auto squared_distance = [&](uint32_t cell) {
    return (position(cell).template cast<double>() - query).squaredNorm();
  };
  uint32_t cell = start_cell;
  double nearest = squared_distance(cell);
  while (true) {
    uint32_t better = cell;
    visit_neighbors(cell, [&](uint32_t neighbor) {
      const double distance = squared_distance(neighbor);
      if (distance < nearest) {
        nearest = distance;
        better = neighbor;
      }
    });
    if (better == cell) return cell;
    cell = better;
  }
}

}  // namespace semfoam
