// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/optim/free_space.h"
#include "foam/optim/optimizer.h"
#include "foam/render/walk.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

// Computes everything that follows from the positions of the sites in training: which cells are
// neighbours, the planes of their faces, which cells must stay empty, and their radii. Positions
// and lengths are those of the normalised frame.

namespace semfoam {

// Holds the adjacency of N sites, which Triangulate() computes, and the planes of their faces,
// which RefreshPlanes() computes. Both may lag behind the sites: triangulating takes about 5 us a
// site, and recomputing the planes takes time too. Guard sites (guard_sites.h) are added here.
//
// The state of an object depends only on the arguments of the last Triangulate() and the last
// RefreshPlanes(): calling these again with triangulated_sites() and the first N positions of
// geometry() gives the same bytes.
class TrainingTopology {
 public:
  // Triangulates `sites` [N] and computes everything below; planes are those of `sites`.
  // `with_areas`: also tv_weights(). Frees the old topology first.
  void Triangulate(const std::vector<Eigen::Vector3f>& sites,
                   const FreeSpace& free_space,
                   bool with_areas);

  // Recomputes the face planes from `sites` [N]; everything else stays.
  void RefreshPlanes(const std::vector<Eigen::Vector3f>& sites) {
    Refresh(WithGuardSites(sites), &geometry_);
  }

  // Returns the cell that contains `origin` by the current planes, a guard's included, searching
  // from cell `from`; an index out of range starts at the last cell.
  uint32_t CellAt(const Eigen::Vector3d& origin, uint32_t from) const;

  // Returns the adjacency of the sites and guards at the last Triangulate(), without tetrahedra.
  const Delaunay& delaunay() const { return delaunay_; }
  // Returns positions and face planes at the last RefreshPlanes().
  const WalkGeometry<float>& geometry() const { return geometry_; }
  // Cells of a larger radius are looked at as bodies, not as their sites, where they must be clear.
  static constexpr float kLargeCell = 0.02f;

  // Returns [N] whether the cell lies in free space and must stay transparent: its site, or, where
  // it is large, a good part of it.
  const std::vector<uint8_t>& is_clear() const { return is_clear_; }
  // Returns [N] what a cell's steps are measured in.
  const std::vector<StepLengths>& step_lengths() const { return step_lengths_; }
  // Returns the weight of the total variation per directed edge of delaunay()
  // (foam/render/total_variation.h); empty without areas.
  const std::vector<float>& tv_weights() const { return tv_weights_; }
  // Returns [N] the positions at the last Triangulate().
  const std::vector<Eigen::Vector3f>& triangulated_sites() const { return triangulated_; }

 private:
  Delaunay delaunay_;
  WalkGeometry<float> geometry_;
  std::vector<uint8_t> is_clear_;
  std::vector<StepLengths> step_lengths_;
  std::vector<float> tv_weights_;
  std::vector<Eigen::Vector3f> triangulated_;
};

}  // namespace semfoam
