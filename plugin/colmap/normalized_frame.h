// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/similarity.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Where a camera stands and looks, world frame.
struct Viewpoint {
  Eigen::Vector3d center;
  Eigen::Vector3d forward;  // unit length, the camera's z
};

// The frame in which training works: its origin in the middle of what was photographed, its unit
// about the distance from which it was.
//
// Origin: the median of the SfM points, coordinate by coordinate. Without points: the point that
// lies nearest to all optical axes, where the axes cross and most cameras look towards it; else the
// median of the camera centres.
//
// Unit: the median distance of the cameras from the origin, but at least
//   - a third of the points' median distance, for cameras in the middle of a room or all in one
//     place, and
//   - what brings every camera within 0.9 kFarRadius, well inside the guards.
// Where all of it is one place (one camera, no points) the unit is one world unit.
//
// Medians: a few wild points or cameras do not matter. Everything scales and moves with the input,
// so scenes of 1e-4 or 1e6 units, or at UTM coordinates, come out alike. Non-finite points are left
// out. CHECKs that there is a camera.
Similarity NormalizedFrame(const std::vector<Viewpoint>& cameras,
                           const std::vector<Eigen::Vector3d>& points);

}  // namespace semfoam
