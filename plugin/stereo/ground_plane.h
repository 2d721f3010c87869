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

// The level ground before a building or in a room: lawns, gravel, roads and floors, seen at grazing
// angles, have hardly an SfM point, and lie nearer than all planes on which a sweep looks. Single
// pixels do not tell where it is, but the borders of all its parts agree on one plane only.

struct GroundPlane : LevelPlane {
  // Mean correlation of the views on the plane, and on those at 1 / 1.4 and 1.4 times the cameras'
  // height above it, whichever is larger.
  double agreement = 0;
  double agreement_beside = 0;
};

// Finds the ground below the cameras by what the photos show where no depth is known; nothing where
// cameras look down rather than ahead, where little is unknown below the horizon, or where no plane
// stands out.
//
// Planes within 7 degrees of level (UpOfCameras; 17 forwards where that rests on how the cameras
// are pitched), at 0.015 to 1.5 of the distance of the sweep's nearest plane below the cameras'
// mean, are compared by the correlation of windows (WindowCorrelation) in photos reduced to a
// quarter; the best ones are refined, in the end in photos that are not reduced. The plane counts
// if
// - the windows on it correlate by 0.45 in the mean, each by its contrast, and by 0.15 more than on
//   planes at other heights,
// - 2 % of the pixels see it nearer than the sweep's nearest plane,
// - at most 2 % of the known points lie below it.
//
// `known` [views] are depth maps, empty of views that take no part; `overlaps` [views].
// Deterministic on any number of threads.
std::optional<GroundPlane> FindGroundPlane(const std::vector<StereoView>& views,
                                           const std::vector<ViewOverlap>& overlaps,
                                           const std::vector<DepthMap>& known);

// Returns [views] the depths of `known`, and those of the plane where a pixel's is unknown and its
// window, in photos reduced to half, correlates by 0.7 with what the plane shows of one of the
// view's first four partners. Deterministic on any number of threads.
std::vector<DepthMap> AddGround(const std::vector<StereoView>& views,
                                const std::vector<ViewOverlap>& overlaps,
                                const LevelPlane& ground,
                                const std::vector<DepthMap>& known);

// Returns the peak memory of FindGroundPlane and AddGround beside their results, in bytes.
uint64_t GroundPlaneBytes(int64_t num_views);

}  // namespace semfoam
