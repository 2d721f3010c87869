// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/solid_ground.h"
#include "foam/data/training_views.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The empty near part of a view: a cone around the directions that it sees, and a ball of half the
// cone's radius around the camera. Normalised frame.
struct ClearCone {
  Eigen::Vector3f apex;
  // Unit length.
  Eigen::Vector3f axis;
  // Cosine of the half angle.
  float cosine = 1;
  float radius = 0;

  bool Contains(const Eigen::Vector3f& x) const {
    const Eigen::Vector3f offset = x - apex;
    const float distance = offset.norm();
    return distance < 0.5f * radius || (distance < radius && offset.dot(axis) > cosine * distance);
  }
};

// Describes the space that must be empty, because matter there would hide what the photos show: the
// near part of every photo's view and of views interpolated between them.
//
// Its depth in a view follows from the SfM points in the view. With n the distance of the nearest
// ones (the 2 % quantile, so that a few wrong ones do not matter) and m the median distance, it is
// n - 0.5 (m - n), within 0.3 n to 0.95 n: where the points lie in a narrow band, as those of one
// distant object, the space before the band is known to be empty; where they are scattered,
// surfaces without a point may be nearer than the nearest point.
//
// Interpolated views: from every photo to those of its 8 nearest ones that look the same way
// (within 60 degrees) and are nearer than 1.5 times the clear radius, a view at every 0.15 of that
// radius. Without them, training places matter of the background's colour between the cameras: each
// photo explains the background of the object by matter near another camera.
//
// Whatever the points say, the ground is not empty (TrainingViews::Ground): where a textured thing
// has nearly all points, a plain table before it looks as if it were before the nearest ones.
class FreeSpace {
 public:
  FreeSpace() = default;
  // Ignores held-out views, and views with fewer than 50 points.
  //
  // The work is bounded, for N views and any number of seeds. If there are more than kMostSeedTests
  // / (number of cones) seeds in and around a cone, an even sample of them is tested, but at least
  // kFewestSampledSeeds. If there would be more than kMostConesBetween interpolated views, they are
  // farther apart.
  FreeSpace(const TrainingViews& views, const std::vector<SeedPoint>& seeds);

  // Maximum number of tests for the photos, and again for the interpolated views.
  static constexpr int64_t kMostSeedTests = int64_t{1} << 27;
  static constexpr int64_t kFewestSampledSeeds = 8192;
  static constexpr int64_t kMostConesBetween = 32768;

  // Returns whether `x` lies in a cone and not in the ground, or beyond sky_begin.
  bool Contains(const Eigen::Vector3f& x) const;

  // Returns the distance from the origin beyond which only sky may be: 1.2 times that within which
  // 99 % of the other seeds lie, and at least three times that of the farthest camera; infinite
  // without seeds of sky (IsSkySite).
  float sky_begin() const { return sky_begin_; }

  const std::vector<ClearCone>& cones() const { return cones_; }

  // Returns how often a seed, or a block of seeds, was tested against a cone.
  int64_t num_seed_tests() const { return num_seed_tests_; }

 private:
  // The voxels from `low` to `high`, both included.
  struct VoxelRange {
    Eigen::Array3i low, high;
  };

  // Lays a box of kGridSide^3 voxels around all cones and lists for each voxel the cones that may
  // overlap it; if there are more than kMostCandidates, an even sample of that number.
  void BuildGrid();
  // Returns the voxels that the cone can touch, and one more on each side.
  VoxelRange VoxelsNear(const ClearCone& cone) const;
  // Does for the voxels (0..kGridSide - 1, y, z) what BuildGrid does for all. `near` holds
  // VoxelsNear of each cone. `candidates` [kGridSide] receives the lists of cones.
  void BuildRow(int y,
                int z,
                const std::vector<VoxelRange>& near,
                std::vector<uint32_t>* candidates);

  static constexpr int kGridSide = 32;
  static constexpr size_t kMostCandidates = 1024;

  std::vector<ClearCone> cones_;
  std::optional<SolidGround> ground_;
  float sky_begin_ = std::numeric_limits<float>::infinity();
  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float voxel_size_ = 1;
  // [voxels] Whether one cone contains the whole voxel.
  std::vector<uint8_t> is_clear_;
  // [voxels + 1] Where the candidates of each voxel begin in candidates_.
  std::vector<uint32_t> begins_;
  // Indices of cones.
  std::vector<uint32_t> candidates_;
  int64_t num_seed_tests_ = 0;
};

}  // namespace semfoam
