// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/similarity.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Position and direction of a camera, world frame.
struct Viewpoint {
  Eigen::Vector3d center;
  // Unit length, the camera's z axis.
  Eigen::Vector3d forward;
};

// Chooses the frame of the training: its origin is in the middle of the photographed scene, its
// unit about the distance from which it was photographed.
//
// Origin: the median of the SfM points, coordinate by coordinate. Without points: the point nearest
// to all optical axes, if the axes cross and most cameras look towards it; else the median of the
// camera centres.
//
// Unit: the median distance of the cameras from the origin, but at least
//   - a third of the points' median distance, for cameras in the middle of a room or all in one
//     place, and
//   - what brings every camera within 0.9 kFarRadius, well inside the guards.
// Where all of it is one place (one camera, no points) the unit is one world unit.
//
// Medians are robust to a few outliers among points and cameras. The result scales and moves with
// the input, so that scenes of 1e-4 or 1e6 units, or at UTM coordinates, are the same in the
// normalised frame. Ignores non-finite points. CHECKs that there is a camera.
Similarity NormalizedFrame(const std::vector<Viewpoint>& cameras,
                           const std::vector<Eigen::Vector3d>& points);

}  // namespace semfoam
