// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The guards: fixed sites of density 0 on a Fibonacci sphere around everything else. They bound
// every real cell, let the last real cell on a ray be shaded, and make coplanar, collinear and tiny
// inputs valid. Never moved, stored or exported.
inline constexpr int kNumGuardSites = 32;
inline constexpr float kGuardRadius = 100;  // normalised frame
inline constexpr float kFarRadius = 30;     // no real site lies farther out

std::vector<Eigen::Vector3f> GuardSites();

// The sites followed by the guards: the positions of all cells, indexed as in Delaunay.
std::vector<Eigen::Vector3f> WithGuardSites(const std::vector<Eigen::Vector3f>& sites);

}  // namespace semfoam
