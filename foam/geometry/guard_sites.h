// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The guards are fixed sites of density 0 on a Fibonacci sphere around all other sites. They bound
// every real cell, so that the last real cell on a ray can be shaded, and make coplanar, collinear
// and tiny inputs valid. They are never moved, stored or exported.
inline constexpr int kNumGuardSites = 32;
// Radius of the sphere of the guards, normalised frame.
inline constexpr float kGuardRadius = 100;
// Maximum distance of a real site from the origin, normalised frame.
inline constexpr float kFarRadius = 30;

// Returns the positions of the guards.
std::vector<Eigen::Vector3f> GuardSites();

// Returns the sites followed by the guards: the positions of all cells, indexed as in Delaunay.
std::vector<Eigen::Vector3f> WithGuardSites(const std::vector<Eigen::Vector3f>& sites);

}  // namespace semfoam
