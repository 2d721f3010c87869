// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/geometry/similarity.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// A dense point cloud to start training from, such as COLMAP's fused.ply or OpenMVS's
// scene_dense.ply.
struct SeedCloud {
  // Dense seeds (SeedPoint::is_dense), one for each voxel (PointMerger).
  std::vector<SeedPoint> points;
  // Number of points in the file.
  int64_t num_points = 0;
  // Of these, without finite coordinates, and beyond kFarRadius.
  int64_t num_not_finite = 0;
  int64_t num_far = 0;
  // False: the file has no colours, and the points are grey.
  bool has_colors = false;
};

// Default of `most` of ReadSeedCloud: enough for a run of two million sites, half of which are at
// points at the start.
inline constexpr size_t kMostCloudPoints = size_t{1} << 20;

// Reads the element vertex of a PLY, text or binary: x, y, z in the frame of the COLMAP model, and
// red, green, blue or diffuse_red ..., integers of 8 or 16 bits or 0..1. Reads over all else, lists
// too. Merges the points within kFarRadius of the normalised frame into at most `most` voxels, in
// memory in proportion to these, whatever the size of the file; the order of the points does not
// matter. CHECKs most >= 8.
//
// Throws UserError, one sentence naming the file, for whatever PlyReader throws, more records than
// the file has room for, and where there is no vertex, no x, y or z, no point with finite
// coordinates, or none within kFarRadius.
SeedCloud ReadSeedCloud(const std::filesystem::path& path,
                        const Similarity& world_from_normalized,
                        size_t most = kMostCloudPoints);

}  // namespace semfoam
