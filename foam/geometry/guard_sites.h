// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The guards are fixed sites of density 0 on a Fibonacci sphere around all other sites. They bound
// every real cell, so that the last real cell on a ray can be shaded, and make coplanar, collinear
// and tiny inputs valid. They are never moved, stored or exported.
inline constexpr int kNumGuardSites = 32;
// Radius of the sphere of the guards, normalised frame.
inline constexpr float kGuardRadius = 100;
// Maximum distance of a real site from the origin, normalised frame, that is not sky.
inline constexpr float kFarRadius = 30;
// Distance of sites that stand for what is infinitely far, such as sky: in training they stay where
// they are, nothing else is opaque between them and the other surfaces, and they are never made
// transparent for want of a ray.
inline constexpr float kSkyRadius = 1.005f * kFarRadius;

SEMFOAM_HOST_DEVICE inline bool IsSkySite(const Eigen::Vector3f& position) {
  constexpr float kLeast = 0.5f * (kFarRadius + kSkyRadius);
  return position.squaredNorm() >= kLeast * kLeast;
}

// Returns the positions of the guards.
std::vector<Eigen::Vector3f> GuardSites();

// Returns the sites followed by the guards: the positions of all cells, indexed as in Delaunay.
std::vector<Eigen::Vector3f> WithGuardSites(const std::vector<Eigen::Vector3f>& sites);

}  // namespace semfoam
