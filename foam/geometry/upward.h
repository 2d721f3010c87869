// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// What is up, by the cameras' poses.
struct CameraUp {
  // Unit length, world frame.
  Eigen::Vector3d up;
  // Whether it is by the cameras' horizontal axes, else by the mean of their upward directions.
  bool by_horizon = false;
  // Median angle by which the cameras are off: their x axes off the horizontal, or their upward
  // directions off the mean.
  double spread_degrees = 0;
};

// Estimates the upward direction of cameras that people hold upright, from cam_from_world.
//
// Cameras are pitched, but hardly rolled: their x axes are horizontal. So up is the direction that
// is most nearly perpendicular to the x axes of most cameras (a robust fit: planes through two axes
// judge the others, then weighted least squares). It does not depend on how the views are spread,
// while the mean of the upward directions (-y) leans towards what cameras on one side look down on.
// That mean, robust (a geometric median), is used where the x axes do not determine a plane, for
// cameras side by side that look the same way.
//
// The sign is that of the mean of the upward directions; where these cancel out (views straight
// down), cameras look down rather than up. Cameras rolled by 90 degrees, as in portrait photos, are
// outliers as long as they are a minority. Returns nothing where neither tells what is up.
std::optional<CameraUp> UpOfCameras(const std::vector<Eigen::Quaterniond>& cam_from_world);

}  // namespace semfoam
