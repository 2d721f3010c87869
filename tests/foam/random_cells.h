// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/render/walk.h"
#include "foam/util/random.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

inline Eigen::Vector3d RandomPoint(CounterRandom* random, double half_extent) {
  const double x = random->Uniform(), y = random->Uniform(), z = random->Uniform();
  return half_extent * (2 * Eigen::Vector3d(x, y, z).array() - 1);
}

inline Eigen::Vector3d RandomDirection(CounterRandom* random) {
  const double x = random->Normal(), y = random->Normal(), z = random->Normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

inline std::vector<Eigen::Vector3f> RandomSites(int count, uint64_t seed) {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < count; ++i) {
    CounterRandom random(seed, 0x51, i);
    sites.push_back(RandomPoint(&random, 1).cast<float>());
  }
  return sites;
}

// Sites with guards, triangulated, ready to walk in double.
struct WalkableCells {
  explicit WalkableCells(const std::vector<Eigen::Vector3f>& sites)
      : positions(WithGuardSites(sites)), delaunay(Triangulate(positions)) {
    std::vector<Eigen::Vector3d> in_double(positions.size());
    for (size_t i = 0; i < positions.size(); ++i) in_double[i] = positions[i].cast<double>();
    Refresh(in_double, delaunay, &geometry);
    Refresh(positions, delaunay, &float_geometry);
  }
  WalkableCells(const WalkableCells&) = delete;

  // The nearest cell by looking at all of them.
  uint32_t BruteForceNearest(const Eigen::Vector3d& x) const {
    uint32_t best = 0;
    for (uint32_t i = 1; i < positions.size(); ++i) {
      if ((positions[i].cast<double>() - x).squaredNorm() <
          (positions[best].cast<double>() - x).squaredNorm()) {
        best = i;
      }
    }
    return best;
  }

  std::vector<Eigen::Vector3f> positions;
  Delaunay delaunay;
  WalkGeometry<double> geometry;
  WalkGeometry<float> float_geometry;
};

}  // namespace semfoam
