// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/guard_sites.h"

#include <cmath>
#include <numbers>

namespace semfoam {

std::vector<Eigen::Vector3f> GuardSites() {
  // Fibonacci sphere: equal steps in z, golden-angle steps around it.
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Eigen::Vector3f> guards(kNumGuardSites);
  for (int i = 0; i < kNumGuardSites; ++i) {
    const double z = 1 - (2 * i + 1.0) / kNumGuardSites;
    const double radius = std::sqrt(1 - z * z);
    const Eigen::Vector3d direction(
        radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z);
    guards[i] = (kGuardRadius * direction).cast<float>();
  }
  return guards;
}

std::vector<Eigen::Vector3f> WithGuardSites(const std::vector<Eigen::Vector3f>& sites) {
  std::vector<Eigen::Vector3f> cells = sites;
  const std::vector<Eigen::Vector3f> guards = GuardSites();
  cells.insert(cells.end(), guards.begin(), guards.end());
  return cells;
}

}  // namespace semfoam
