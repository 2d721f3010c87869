// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

// Thins dense point clouds by voxels: of all points in a voxel, one is left, at their mean position
// and in their mean colour. All positions are in the normalised frame, within kSkyRadius.
//
// Voxels are cubes within distance 1 of the origin, about the distance from which the scene was
// photographed. Beyond, their edges grow as r / (1 + ln r) across and as r along the distance r,
// because the photos resolve what is farther away less finely: they are cubes of
// x (1 + ln |x|) / |x|.

namespace semfoam {

// Merges a stream of points in bounded memory: up to 200 bytes for each of `most`. The voxels have
// the smallest edge of 9 / 2^(21 - k), k = 0, 1, ..., that leaves `most` points or fewer. The
// result does not depend on the order of the points.
class PointMerger {
 public:
  // CHECKs most >= 8: a voxel for each octant.
  explicit PointMerger(size_t most);

  // Adds a point, finite and within kSkyRadius; display values, clamped to 0..1, where NaN is grey.
  void Add(const Eigen::Vector3d& position, const Eigen::Vector3f& color);

  // Returns one dense seed (SeedPoint::is_dense) for each voxel, in Morton order, and empties this
  // object.
  std::vector<SeedPoint> Take();

 private:
  // Whole numbers, whose sums do not depend on the order.
  struct Voxel {
    uint64_t key;
    int64_t position[3];
    uint64_t color[3];
    uint64_t count;
  };
  // Merges the voxels of equal keys, and doubles the edge until no more than `most_` are left.
  void Merge();

  size_t most_;
  // Number of times the edge was doubled.
  int level_ = 0;
  std::vector<Voxel> voxels_;
};

// Returns at most `most` of the dense seeds `points`, without those in a voxel with one of the
// positions `taken`. The edge of the voxels is found by bisection, to within 1 %, on their number.
// Where there are no more than `most`, only points at exactly a position of `taken` are left out.
// The result depends on the order of the points only in the last digit.
std::vector<SeedPoint> ThinPoints(const std::vector<SeedPoint>& points,
                                  const std::vector<Eigen::Vector3f>& taken,
                                  size_t most);

}  // namespace semfoam
