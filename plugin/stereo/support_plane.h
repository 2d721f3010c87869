// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/level_plane.h"
#include "plugin/stereo/plane_sweep.h"
#include "plugin/stereo/stereo_view.h"
#include "plugin/stereo/view_overlap.h"

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The plain table, floor or sheet of paper that things stand on: it has hardly a point of its own,
// but all points of the things end at it.

// Finds the plane that the points stand on; nothing where no plane is bounded by them so, or where
// the depth of a tenth of it is known anyway.
//
// Of the planes within 30 degrees of level (UpOfCameras), at the height of the lowest 3 % of the
// points, the plane has the most points within 1 % of their spread, less four times those that go
// on below it: a ball or a bush has as many there. The plane counts if
// - 50 points or more are on it, and not a quarter as many lie just below it,
// - they surround the middle of all points, at half of the others' distance from it at least:
//   things stand on three legs, while the points of one side of a thing tilt the plane, and a ball
//   has a lowest point on each,
// - 95 % of the cameras are above it.
//
// `points` are in the normalised frame; `known` [views] are depth maps, empty of views that take no
// part. Deterministic; does not depend on the number of threads.
std::optional<LevelPlane> FindSupportPlane(const std::vector<StereoView>& views,
                                           const std::vector<Eigen::Vector3f>& points,
                                           const std::vector<DepthMap>& known);

// Returns [views] the depths of `known`, and those of the plane where whole regions of one colour
// (FindPlainRegions), in photos reduced to a quarter, have the same colours in at least half of the
// other views that show the same places of the plane, within 6 % of white and up to a gain for
// each view. A region counts if 60 % of its pixels agree so. Pixels that are cut off, and
// those that see the plane below things or farther out than the cameras are, do not.
// Deterministic on any number of threads.
std::vector<DepthMap> AddSupport(const std::vector<StereoView>& views,
                                 const std::vector<ViewOverlap>& overlaps,
                                 const LevelPlane& plane,
                                 const std::vector<Eigen::Vector3f>& points,
                                 const std::vector<DepthMap>& known);

// Returns the peak memory of AddSupport beside its result, in bytes.
uint64_t SupportPlaneBytes(int64_t num_views);

}  // namespace semfoam
