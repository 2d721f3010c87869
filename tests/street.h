// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace semfoam {

// A street along x, as long as it is asked for: a road below z = 0, a wall along all of it, and a
// house every two units on its other side. It is 2 wide (y) and 1 high (z).
enum class StreetPart { kAir = -1, kRoad = 0, kWall = 1, kHouse = 2 };

inline constexpr float kWallFront = 0.9f, kWallHeight = 0.5f;
inline constexpr float kHouseSpacing = 2, kHouseBegin = 0.4f, kHouseEnd = 1.6f;
inline constexpr float kHouseFront = -0.4f, kHouseHeight = 0.7f;

// How far along its own two units of the street a place is.
inline float AlongHouse(float x) { return x - kHouseSpacing * std::floor(x / kHouseSpacing); }

inline bool IsBesideHouse(float x) {
  return AlongHouse(x) > kHouseBegin && AlongHouse(x) < kHouseEnd;
}

inline StreetPart StreetPartAt(const Eigen::Vector3f& p) {
  if (p.z() < 0) return StreetPart::kRoad;
  if (p.y() > kWallFront && p.z() < kWallHeight) return StreetPart::kWall;
  const bool is_house = IsBesideHouse(p.x()) && p.y() < kHouseFront && p.z() < kHouseHeight;
  return is_house ? StreetPart::kHouse : StreetPart::kAir;
}

}  // namespace semfoam
