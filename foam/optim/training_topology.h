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

// All that hangs on the places of the sites of a foam in training: who is whose neighbour, the
// planes between them, and what is derived from these. Triangulating costs much and moving the
// planes something, so both lag behind the sites: `delaunay` is that of the places at the last
// Triangulate, `geometry` has the planes of those at the last Follow.
class TrainingTopology {
 public:
  // Of these sites, their planes included. `with_areas`: also `tv_weights`.
  void Triangulate(const std::vector<Eigen::Vector3f>& sites,
                   const FreeSpace& free_space,
                   bool with_areas);

  // Brings the planes up to date with the sites.
  void Follow(const std::vector<Eigen::Vector3f>& sites) {
    Refresh(WithGuardSites(sites), &geometry_);
  }

  // The cell that a camera is in, found from a cell near it, or any.
  uint32_t CellAt(const Eigen::Vector3d& origin, uint32_t from) const;

  const Delaunay& delaunay() const { return delaunay_; }  // without its tetrahedra
  const WalkGeometry<float>& geometry() const { return geometry_; }
  // [N] in free space: the cell stays transparent
  const std::vector<uint8_t>& is_clear() const { return is_clear_; }
  // [N] of the cells, bounded: steps of a site are in proportion to it
  const std::vector<float>& radius() const { return radius_; }
  // per directed edge (foam/render/total_variation.h); empty without areas
  const std::vector<float>& tv_weights() const { return tv_weights_; }

  // The sites' places at the last Triangulate. With those of `geometry`, which has them first, two
  // calls make everything again, bit for bit.
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
