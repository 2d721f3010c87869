// SPDX-License-Identifier: GPL-3.0-or-later
//
// Hard places for sites: where Delaunay is not unique, where there is none, and where a float
// hardly tells two sites apart.
#include "foam/geometry/guard_sites.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/hard_cases/hard_case.h"

namespace semfoam {
namespace {

using Sites = std::vector<Eigen::Vector3f>;

// 9 x 9 x 9 sites a quarter apart: every coordinate, difference and midpoint is a float.
Sites CubicGrid() {
  Sites sites;
  for (int i = 0; i < 9 * 9 * 9; ++i) {
    sites.push_back(Eigen::Vector3f(i % 9, i / 9 % 9, i / 81) / 4.f - Eigen::Vector3f::Ones());
  }
  return sites;
}

Sites Jittered(Sites sites, double jitter) {
  CounterRandom random(1, 0x81, 0);
  for (Eigen::Vector3f& p : sites) {
    p = (p.cast<double>() + RandomPoint(&random, jitter)).cast<float>();
  }
  return sites;
}

// Random points, mapped one by one.
template <typename Map>
Sites Mapped(int count, const Map& map) {
  Sites sites = RandomSites(count, 3);
  for (Eigen::Vector3f& p : sites) p = map(p);
  return sites;
}

Sites NearDuplicates(bool exact) {
  Sites sites = RandomSites(200, 8);
  for (int i = 0; i < 200; ++i) {
    Eigen::Vector3f p = sites[i];
    if (!exact) p.x() = std::nextafter(p.x(), 2.f);
    sites.push_back(p);
  }
  return sites;
}

const Eigen::Vector3d kOneUlpCell(0.3, -0.6, 0.7);

// Sites at the corners, edges and faces of a cube one unit in the last place wide on each side of a
// site, among others: the site's own cell is a few ulp wide and has no face that a float can
// measure.
Sites WithOneUlpCell() {
  Sites sites = RandomSites(100, 4);
  const Eigen::Vector3f middle = ToFloat(kOneUlpCell);
  for (int i = 0; i < 27; ++i) {
    const int step[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    Eigen::Vector3f p = middle;
    for (int c = 0; c < 3; ++c) {
      if (step[c] != 0) p[c] = std::nextafter(p[c], step[c] * 2.f);
    }
    sites.push_back(p);
  }
  return sites;
}

Sites Cluster(int count, const Eigen::Vector3d& middle) {
  Sites sites = RandomSites(300, 5);
  CounterRandom random(5, 0x82, 0);
  for (int i = 0; i < count; ++i) {
    sites.push_back((middle + RandomPoint(&random, 5e-7)).cast<float>());
  }
  return sites;
}

// On the sphere that no site may leave, on the guards' own sphere, and exactly on a guard.
Sites AtTheGuards() {
  Sites sites = RandomSites(200, 6);
  CounterRandom random(6, 0x83, 0);
  for (const float radius : {kFarRadius, 0.999f * kGuardRadius, kGuardRadius}) {
    for (int i = 0; i < 100; ++i) {
      sites.push_back(radius * RandomDirection(&random).cast<float>());
    }
  }
  sites.push_back(GuardSites()[5]);
  return sites;
}

// Towards the sites, for a cluster that random rays would miss.
std::vector<RayCase> RaysTowards(const Eigen::Vector3d& target, double radius, int count) {
  std::vector<RayCase> rays = RaysFromEverywhere(count, 7);
  for (int i = 0; i < count; ++i) {
    CounterRandom random(7, 0x84, i);
    rays[i].direction = (target + RandomPoint(&random, radius) - rays[i].origin).normalized();
  }
  return rays;
}

// Rays from everywhere and along the axes, through the cells of `sites`.
HardCase SitesCase(const std::string& name,
                   const std::string& expected,
                   const std::function<Sites()>& sites,
                   const RayBounds& bounds = {},
                   int num_rays = 100) {
  return {name, expected, [=](const CheckOptions& options) {
            const RayScene scene(sites(), 11);
            std::vector<RayCase> rays = RaysFromEverywhere(num_rays, 12);
            for (int axis = 0; axis < 3; ++axis) {
              rays.push_back(MakeRay({0, 0, 0}, Eigen::Vector3d::Unit(axis), axis));
              rays.push_back(
                  MakeRay(-2 * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::Unit(axis), axis));
            }
            return CheckRays(scene, rays, bounds, options);
          }};
}

// Rays towards the places within `spread` of `target`.
HardCase TargetCase(const std::string& name,
                    const std::string& expected,
                    const std::function<Sites()>& sites,
                    const Eigen::Vector3d& target,
                    double spread,
                    const RayBounds& bounds = {}) {
  return {name, expected, [=](const CheckOptions& options) {
            const RayScene scene(sites(), 11, 0, 2);
            return CheckRays(scene, RaysTowards(target, spread, 24), bounds, options);
          }};
}

}  // namespace

std::vector<HardCase> SitesCases() {
  const std::string exact = "every piece lies in the cell of its nearest site";
  RayBounds at_the_guards, coarse, narrow;
  at_the_guards.ends_in_guard = false;
  // A t of 1 has bits of 1e-7, a tenth of the cluster.
  coarse.color_float = 1e-2;
  // A segment of 1e-8 is the difference of two distances, of which double knows 1e-16.
  narrow.gradient_double = 1e-6;
  const Eigen::Vector3d off_center(0.3, 0.2, -0.6);
  std::vector<HardCase> cases = {
      SitesCase("cubic_grid", exact + ", ties or not", CubicGrid),
      SitesCase("cubic_grid_jittered_by_1e-6", exact, [] { return Jittered(CubicGrid(), 1e-6); }),
      SitesCase("cubic_grid_jittered_by_1e-9", exact, [] { return Jittered(CubicGrid(), 1e-9); }),
      SitesCase("cospherical",
                exact,
                [] {
                  return Mapped(300, [](const auto& p) { return Eigen::Vector3f(p.normalized()); });
                }),
      SitesCase("coplanar",
                exact,
                [] {
                  return Mapped(300,
                                [](const auto& p) { return Eigen::Vector3f(p.x(), p.y(), 0); });
                }),
      SitesCase(
          "collinear",
          exact,
          [] { return Mapped(300, [](const auto& p) { return Eigen::Vector3f(p.x(), 0, 0); }); }),
      SitesCase("exact_duplicates",
                "the first of two sites at one place has the cell, the other none",
                [] { return NearDuplicates(true); }),
      SitesCase("duplicates_one_ulp_apart", exact, [] { return NearDuplicates(false); }),
      TargetCase("a_cell_one_ulp_wide", exact, WithOneUlpCell, kOneUlpCell, 3e-8, narrow),
      TargetCase(
          "cluster_of_1e5_within_1e-6",
          exact,
          [] { return Cluster(100'000, Eigen::Vector3d::Zero()); },
          Eigen::Vector3d::Zero(),
          2e-7),
      TargetCase(
          "cluster_where_floats_are_coarse",
          exact + ", colours to 1e-2",
          [off_center] { return Cluster(20'000, off_center); },
          off_center,
          2e-7,
          coarse),
      SitesCase("on_the_guard_sphere", exact + ", unbounded ones too", AtTheGuards, at_the_guards),
  };
  for (int count = 0; count <= 5; ++count) {
    cases.push_back(SitesCase(
        std::to_string(count) + (count == 1 ? "_site" : "_sites"),
        exact,
        [count] { return RandomSites(count, 9); },
        {},
        20));
  }
  return cases;
}

}  // namespace semfoam
