// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The near part of a view, where nothing is: a cone around what it sees, and a ball half as large
// around the camera itself. Normalised frame.
struct ClearCone {
  Eigen::Vector3f apex;
  Eigen::Vector3f axis;  // unit length
  float cosine = 1;      // of the half angle
  float radius = 0;

  bool Contains(const Eigen::Vector3f& x) const {
    const Eigen::Vector3f offset = x - apex;
    const float distance = offset.norm();
    return distance < 0.5f * radius || (distance < radius && offset.dot(axis) > cosine * distance);
  }
};

// The space that must be empty, as otherwise the photos would show what is there and not what they
// do: the near part of every photo's view and of the views in between.
//
// How far it reaches is read from the SfM points in the view. With n the distance of the nearest
// ones (the 2 % quantile, so that a few wrong ones do not matter) and m the median distance, it is
// n - 0.5 (m - n), within 0.3 n to 0.95 n: where the points lie in a narrow band, as of one object
// from afar, what is before the band is known to be empty; where they are scattered, things without
// a point may be nearer than the nearest point.
//
// Views in between: from every photo to those of its 8 nearest ones that look the same way (within
// 60 degrees) and stand nearer than 1.5 times the clear radius, a view at every 0.15 of that
// radius. Without them, matter of the background's colour gathers before the cameras that nobody
// had: each photo explains what is behind the object by something near another camera.
class FreeSpace {
 public:
  FreeSpace() = default;
  // Held-out views are not looked at. A view with fewer than 50 points says nothing.
  //
  // The work is bounded, for N views and any number of seeds. Of the seeds in and around a cone an
  // even sample is looked at where there are more than kMostSeedTests / (number of cones), but at
  // least kFewestSampledSeeds of them. Where the views in between would be more than
  // kMostConesBetween, they are farther apart.
  FreeSpace(const TrainingViews& views, const std::vector<SeedPoint>& seeds);

  static constexpr int64_t kMostSeedTests = int64_t{1} << 27;  // of the photos; as many in between
  static constexpr int64_t kFewestSampledSeeds = 8192;
  static constexpr int64_t kMostConesBetween = 32768;

  bool Contains(const Eigen::Vector3f& x) const;

  const std::vector<ClearCone>& cones() const { return cones_; }

  // How many times a seed, or a block of seeds, was held against a cone.
  int64_t num_seed_tests() const { return num_seed_tests_; }

 private:
  // The voxels from `low` to `high`, both included.
  struct VoxelRange {
    Eigen::Array3i low, high;
  };

  // Lays a box of kGridSide^3 voxels around all cones and finds for each the cones that may hold a
  // part of it, but with an even choice of kMostCandidates of them where they are more.
  void BuildGrid();
  // Returns the voxels that the cone can touch, and one more on each side.
  VoxelRange VoxelsNear(const ClearCone& cone) const;
  // Does for the voxels (0..kGridSide - 1, y, z) what BuildGrid does for all. `near`: of each cone.
  // `candidates`: [kGridSide] lists of cones.
  void BuildRow(int y,
                int z,
                const std::vector<VoxelRange>& near,
                std::vector<uint32_t>* candidates);

  static constexpr int kGridSide = 32;
  static constexpr size_t kMostCandidates = 1024;

  std::vector<ClearCone> cones_;
  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float voxel_size_ = 1;
  std::vector<uint8_t> is_clear_;     // [voxels] as a whole
  std::vector<uint32_t> begins_;      // [voxels + 1] into candidates_
  std::vector<uint32_t> candidates_;  // cones
  int64_t num_seed_tests_ = 0;
};

}  // namespace semfoam
