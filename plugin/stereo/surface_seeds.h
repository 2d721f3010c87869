// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/solid_ground.h"
#include "foam/data/training_views.h"
#include "plugin/dataset/photo_depths.h"
#include "plugin/dataset/training_scene.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

// Finds points on the surfaces that photos show and SfM leaves without points, for the foam to
// start from: a plane sweep for each photo, whose depths must agree with those of other photos; and
// planes through these where photos are plain.

// The points and the depths that were found.
struct SurfaceSeeds {
  // Dense seeds (SeedPoint::is_dense) in the normalised frame: at most kMostSurfaceSeeds that were
  // measured, then those of plain surfaces, then at most kMostSkySeeds of what is infinitely far,
  // at kSkyRadius.
  std::vector<SeedPoint> points;
  // [views] The depths of all points, of each photo of the scene; empty where it was not swept.
  std::vector<PhotoDepths> depths;
  // Share of the swept photos' pixels that are infinitely far (FindFarRegions), and the number of
  // photos that show some of them.
  double far_share = 0;
  int num_far = 0;
  // Whether the ground before the cameras was found (FindGroundPlane).
  bool has_ground = false;
  // Whether the plane that things stand on was (FindSupportPlane).
  bool has_support = false;
  // Either of them, as far as there are points on it.
  std::optional<SolidGround> solid_ground;
  // Number of photos that were swept, and of training photos.
  int num_swept = 0;
  int num_training = 0;
  double seconds = 0;

  // Returns "Plane sweep: 21480 seeds from 56 photos in 3.1 s".
  std::string Report() const;
};

inline constexpr int kMostSurfaceSeeds = 500'000;
inline constexpr int kMostSkySeeds = 4'000;

// Sweeps at most `most_photos` of the training photos, evenly spread by name, never a held-out one
// (SweepPlanes), and keeps the depths on which the maps of two other views agree, within 1.5 % and
// in about the same colour, and which fewer views contradict: those that see through the point, or
// see another colour there (at the outlines of things, windows carry the depth of the thing over to
// what is behind it). A depth that is kept is replaced by the mean of those that agree. Points in
// the same voxel are merged (PointMerger). Then fills the maps (AddGround or AddSupport,
// FillDepths, FillPlanes), and keeps what is new by the same rules, or what is on the ground or
// support (FindGroundPlane, FindSupportPlane) and no view contradicts, merged to an eighth of the
// number of points that were measured. With `find_sky`, what is infinitely far (FindFarRegions)
// gets seeds at kSkyRadius, and rays to it a distance of 0.7 times that. Colours are those of the
// reference exposure. Finds nothing where fewer than three photos overlap. The result does not
// depend on the number of threads. Throws as TrainingScene::OpenView does.
SurfaceSeeds FindSurfaceSeeds(const TrainingScene& scene, int most_photos, bool find_sky = true);

// Returns the peak memory of FindSurfaceSeeds in bytes, in addition to the scene and the photos
// that it opens.
uint64_t SurfaceSeedBytes(int64_t num_photos);

// Returns the memory of SurfaceSeeds::depths in bytes.
uint64_t PhotoDepthBytes(int64_t num_photos);

}  // namespace semfoam
