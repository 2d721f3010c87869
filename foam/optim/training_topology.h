// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/optim/free_space.h"
#include "foam/render/walk.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Adjacency, face planes and everything else derived from the positions of the sites in training.
// Both lag behind the sites, because triangulating is expensive and moving planes costs something:
// delaunay() belongs to the positions at the last Triangulate(), geometry() to those at the last
// Follow().
class TrainingTopology {
 public:
  // Triangulates `sites` and computes all members. `with_areas`: also tv_weights().
  void Triangulate(const std::vector<Eigen::Vector3f>& sites,
                   const FreeSpace& free_space,
                   bool with_areas);

  // Recomputes the face planes from `sites`; the adjacency stays.
  void Follow(const std::vector<Eigen::Vector3f>& sites) {
    Refresh(WithGuardSites(sites), &geometry_);
  }

  // Returns the cell that contains `origin` (normalised frame), searching from cell `from`.
  uint32_t CellAt(const Eigen::Vector3d& origin, uint32_t from) const;

  // Without its tetrahedra.
  const Delaunay& delaunay() const { return delaunay_; }
  const WalkGeometry<float>& geometry() const { return geometry_; }
  // [N] Whether the cell lies in free space and is kept transparent.
  const std::vector<uint8_t>& is_clear() const { return is_clear_; }
  // [N] Radius of the cell, bounded; steps of a site are proportional to it.
  const std::vector<float>& radius() const { return radius_; }
  // Weight per directed edge (foam/render/total_variation.h); empty without areas.
  const std::vector<float>& tv_weights() const { return tv_weights_; }

  // [N] Positions at the last Triangulate(). Together with the positions in geometry() they
  // reproduce this object bit for bit: Triangulate() with these, then Follow() with those.
  const std::vector<Eigen::Vector3f>& triangulated_sites() const { return triangulated_; }

 private:
  Delaunay delaunay_;
  WalkGeometry<float> geometry_;
  std::vector<uint8_t> is_clear_;
  std::vector<float> radius_;
  std::vector<float> tv_weights_;
  std::vector<Eigen::Vector3f> triangulated_;
};

}  // namespace semfoam
