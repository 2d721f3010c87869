// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/walk.h"

#include "foam/geometry/voronoi.h"

#include <cmath>
#include <set>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

struct Segment {
  uint32_t cell;
  double t_in, t_out;
  bool clamped;
};

template <typename Real>
std::vector<Segment> WalkAll(const WalkGeometry<Real>& geometry,
                             const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction,
                             uint32_t start) {
  std::vector<Segment> segments;
  const bool ended = Walk<Real>(geometry,
                                origin.cast<Real>(),
                                direction.cast<Real>(),
                                start,
                                [&](uint32_t cell, Real t_in, Real t_out, uint32_t, bool clamped) {
                                  segments.push_back({cell, t_in, t_out, clamped});
                                  return true;
                                });
  EXPECT_TRUE(ended) << "the step limit was hit";
  return segments;
}

// The walk against looking at all sites: wherever a ray is, the nearest site is the cell reported;
// segments follow on each other; p.d grows strictly; no cell comes twice.
template <typename Real>
void ExpectWalkIsRight(const WalkableCells& cells,
                       const WalkGeometry<Real>& geometry,
                       const Eigen::Vector3d& origin,
                       const Eigen::Vector3d& direction,
                       double tolerance) {
  const std::vector<Segment> segments =
      WalkAll(geometry, origin, direction, cells.BruteForceNearest(origin));
  double t = 0;
  std::set<uint32_t> seen;
  for (size_t n = 0; n < segments.size(); ++n) {
    const Segment& segment = segments[n];
    ASSERT_EQ(segment.t_in, t);
    ASSERT_GE(segment.t_out, segment.t_in);
    t = segment.t_out;
    ASSERT_TRUE(seen.insert(segment.cell).second) << "cell " << segment.cell << " twice";
    if (n > 0) {
      const double before = cells.geometry.positions[segments[n - 1].cell].dot(direction);
      ASSERT_GT(cells.geometry.positions[segment.cell].dot(direction), before - tolerance);
    }
    for (const double at : {0.1, 0.5, 0.9}) {
      const Eigen::Vector3d x =
          origin + (segment.t_in + at * (segment.t_out - segment.t_in)) * direction;
      const double own = (cells.geometry.positions[segment.cell] - x).norm();
      const double nearest = (cells.geometry.positions[cells.BruteForceNearest(x)] - x).norm();
      ASSERT_LE(own, nearest + tolerance * (1 + x.norm())) << "cell " << segment.cell;
    }
  }
  // The lengths add up to the exit: the last segment ends where the unbounded cell begins.
  const Eigen::Vector3d beyond = origin + (t + 1000) * direction;
  EXPECT_GE(cells.BruteForceNearest(beyond), cells.delaunay.num_sites) << "left a bounded cell";
}

void ExpectWalksAreRight(const std::vector<Eigen::Vector3f>& sites, int num_rays, uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const WalkableCells cells(sites);
  for (int i = 0; i < num_rays; ++i) {
    SCOPED_TRACE(i);
    CounterRandom random(seed, 0x61, i);
    const Eigen::Vector3d origin = RandomPoint(&random, i % 4 == 0 ? 150 : 1.2);
    const Eigen::Vector3d direction =
        i % 4 == 0 ? (RandomPoint(&random, 1) - origin).normalized() : RandomDirection(&random);
    {
      SCOPED_TRACE("double");
      ExpectWalkIsRight(cells, cells.geometry, origin, direction, 1e-9);
    }
    SCOPED_TRACE("float");
    ExpectWalkIsRight(cells, cells.float_geometry, origin, direction, 2e-4);
  }
}

TEST(Walk, AgreesWithBruteForceOnRandomSites) { ExpectWalksAreRight(RandomSites(2000, 1), 100, 1); }

TEST(Walk, AgreesWithBruteForceOnACubicGrid) {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < 1000; ++i) {
    sites.push_back(Eigen::Vector3f(i % 10, i / 10 % 10, i / 100) / 5.f - Eigen::Vector3f::Ones());
  }
  ExpectWalksAreRight(sites, 60, 2);
}

TEST(Walk, AlongLatticeLinesAndThroughSitesEndsAndIsRight) {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < 512; ++i) sites.emplace_back(i % 8 / 4.f, i / 8 % 8 / 4.f, i / 64 / 4.f);
  const WalkableCells cells(sites);
  const Eigen::Vector3d directions[] = {{1, 0, 0},
                                        {0, -1, 0},
                                        Eigen::Vector3d(1, 1, 0).normalized(),
                                        Eigen::Vector3d(1, 1, 1).normalized()};
  for (const Eigen::Vector3d& direction : directions) {
    // Through sites; along faces and edges; through vertices.
    for (const Eigen::Vector3d& offset : {Eigen::Vector3d(0, 0, 0),
                                          Eigen::Vector3d(0.125, 0.125, 0.125),
                                          Eigen::Vector3d(0, 0.125, 0)}) {
      const Eigen::Vector3d origin = Eigen::Vector3d(1, 1, 1) + offset - 2 * direction;
      ExpectWalkIsRight(cells, cells.geometry, origin, direction, 1e-9);
      ExpectWalkIsRight(cells, cells.float_geometry, origin, direction, 2e-4);
    }
  }
}

TEST(Walk, OfDegenerateSites) {
  std::vector<Eigen::Vector3f> plane, line, sphere, few, duplicates;
  for (int i = 0; i < 200; ++i) {
    CounterRandom random(3, 0x62, i);
    const Eigen::Vector3f p = RandomPoint(&random, 1).cast<float>();
    plane.emplace_back(p.x(), p.y(), 0.f);
    line.emplace_back(p.x(), 0.f, 0.f);
    sphere.push_back(RandomDirection(&random).cast<float>());
    duplicates.push_back(p);
    duplicates.push_back(p);
    if (i < 5) few.push_back(p);
  }
  ExpectWalksAreRight(plane, 20, 4);
  ExpectWalksAreRight(line, 20, 5);
  ExpectWalksAreRight(sphere, 20, 6);
  ExpectWalksAreRight(few, 20, 7);
  ExpectWalksAreRight(duplicates, 20, 8);
  ExpectWalksAreRight({Eigen::Vector3f::Zero()}, 10, 9);
  ExpectWalksAreRight({}, 10, 10);
}

TEST(Walk, OfSitesOneUlpApart) {
  // In double the two half cells are told apart. In float the order of two faces 1e-7 apart can
  // come out either way, and the walk may then follow the wrong half; it must still end, and never
  // step back.
  std::vector<Eigen::Vector3f> sites = RandomSites(200, 8);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3f p = sites[i];
    sites.emplace_back(std::nextafter(p.x(), 2.f), p.y(), p.z());
  }
  const WalkableCells cells(sites);
  for (int i = 0; i < 60; ++i) {
    CounterRandom random(8, 0x66, i);
    const Eigen::Vector3d origin = RandomPoint(&random, 1.2), direction = RandomDirection(&random);
    ExpectWalkIsRight(cells, cells.geometry, origin, direction, 1e-9);
    double t = 0;
    for (const Segment& segment :
         WalkAll(cells.float_geometry, origin, direction, cells.BruteForceNearest(origin))) {
      ASSERT_EQ(segment.t_in, t);
      ASSERT_GE(segment.t_out, segment.t_in);
      t = segment.t_out;
    }
  }
}

TEST(Walk, EndsOnATopologyOlderThanThePositions) {
  WalkableCells cells(RandomSites(1000, 11));
  std::vector<Eigen::Vector3f> moved = cells.positions;
  CounterRandom random(11, 0x63, 0);
  for (size_t i = 0; i < 1000; ++i) moved[i] += 0.1f * RandomDirection(&random).cast<float>();
  Refresh(moved, cells.delaunay, &cells.float_geometry);
  size_t clamped = 0;
  for (int i = 0; i < 500; ++i) {
    CounterRandom ray(11, 0x64, i);
    const Eigen::Vector3d origin = RandomPoint(&ray, 1);
    double t = 0;
    for (const Segment& segment : WalkAll(cells.float_geometry,
                                          origin,
                                          RandomDirection(&ray),
                                          cells.BruteForceNearest(origin))) {
      ASSERT_EQ(segment.t_in, t);
      ASSERT_GE(segment.t_out, segment.t_in);
      t = segment.t_out;
      clamped += segment.clamped;
    }
  }
  EXPECT_GT(clamped, 0u) << "nothing was stale, so nothing was tested";
}

TEST(Walk, CrossingDerivativesAgreeWithDifferences) {
  CounterRandom random(12, 0x65, 0);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d o = RandomPoint(&random, 1), p = RandomPoint(&random, 1);
    const Eigen::Vector3d d = RandomDirection(&random);
    const Eigen::Vector3d q = p + 0.3 * d + 0.2 * RandomDirection(&random);
    Eigen::Vector3d dt_dp, dt_dq;
    const double t = CrossingDistance<double>(o - p, q - p, d);
    CrossingDerivatives<double>(o - p, q - p, d, t, &dt_dp, &dt_dq);
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d h = 1e-6 * Eigen::Vector3d::Unit(c);
      const auto at = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        return CrossingDistance<double>(o - a, b - a, d);
      };
      EXPECT_NEAR(dt_dp[c], (at(p + h, q) - at(p - h, q)) / 2e-6, 1e-6 * (1 + dt_dp.norm()));
      EXPECT_NEAR(dt_dq[c], (at(p, q + h) - at(p, q - h)) / 2e-6, 1e-6 * (1 + dt_dq.norm()));
    }
  }
}

}  // namespace
}  // namespace semfoam
