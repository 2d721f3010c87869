// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/point_thinning.h"

#include "foam/optim/initialization.h"
#include "foam/util/random_vectors.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

// A noisy sphere of radius 0.8 around (0.1, 0, 0), whose colours tell the octant.
std::vector<SeedPoint> Sphere(size_t count, float radius = 0.8f) {
  std::vector<SeedPoint> points;
  for (size_t i = 0; i < count; ++i) {
    CounterRandom random(3, 1, i);
    const Eigen::Vector3d direction = NormalVector(&random).normalized();
    const double r = radius * (1 + 0.01 * (random.Uniform() - 0.5));
    const Eigen::Vector3f color = (direction.array() > 0).cast<float>();
    points.push_back({(r * direction).cast<float>(), color, true});
    points.back().position.x() += 0.1f;
  }
  return points;
}

std::vector<SeedPoint> Merge(const std::vector<SeedPoint>& points, size_t most) {
  PointMerger merger(most);
  for (const SeedPoint& point : points) merger.Add(point.position.cast<double>(), point.color);
  return merger.Take();
}

bool SameBytes(const std::vector<SeedPoint>& a, const std::vector<SeedPoint>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const SeedPoint& p, const SeedPoint& q) {
        return p.position == q.position && p.color == q.color && p.is_dense == q.is_dense;
      });
}

TEST(PointMerger, DoesNotDependOnTheOrder) {
  std::vector<SeedPoint> points = Sphere(30'000);
  const std::vector<SeedPoint> merged = Merge(points, 1000);
  EXPECT_LE(merged.size(), 1000u);
  EXPECT_GT(merged.size(), 200u);  // one doubling of the edge leaves about a quarter of a surface
  std::reverse(points.begin(), points.end());
  EXPECT_TRUE(SameBytes(Merge(points, 1000), merged));
  std::sort(points.begin(), points.end(), [](const SeedPoint& a, const SeedPoint& b) {
    return a.position.x() < b.position.x();
  });
  EXPECT_TRUE(SameBytes(Merge(points, 1000), merged));
}

TEST(PointMerger, KeepsFewPointsAsTheyAre) {
  const std::vector<SeedPoint> points = Sphere(100);
  std::vector<SeedPoint> merged = Merge(points, 1000);
  ASSERT_EQ(merged.size(), points.size());
  for (const SeedPoint& point : points) {
    EXPECT_TRUE(std::any_of(merged.begin(), merged.end(), [&](const SeedPoint& m) {
      return (m.position - point.position).norm() < 1e-7f && m.color == point.color && m.is_dense;
    }));
  }
}

TEST(PointMerger, TakesTheMeanOfAVoxel) {
  PointMerger merger(8);
  for (const double x : {0.001, 0.003}) {
    merger.Add({x, x, x}, Eigen::Vector3f::Constant(static_cast<float>(100 * x)));
  }
  // So many octants and places that the first two points share a voxel.
  for (int i = 0; i < 8; ++i) {
    merger.Add({(i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2) - 0.5}, {0, 2, NAN});
  }
  const std::vector<SeedPoint> merged = merger.Take();
  ASSERT_EQ(merged.size(), 8u);
  // Of the octant with three points.
  const SeedPoint& last = merged.back();
  EXPECT_NEAR(last.position.x(), (0.001 + 0.003 + 0.5) / 3, 1e-6);
  EXPECT_NEAR(last.color.x(), (0.1 + 0.3) / 3, 1e-4);
  EXPECT_NEAR(last.color.y(), (0.1 + 0.3 + 1) / 3, 1e-4);
  EXPECT_NEAR(last.color.z(), (0.1 + 0.3 + 0.5) / 3, 1e-4);
}

TEST(ThinPoints, LeavesAlmostAsManyAsAreAskedFor) {
  const std::vector<SeedPoint> points = Sphere(30'000);
  for (const size_t most : {1u, 10u, 500u, 3000u, 20'000u}) {
    const std::vector<SeedPoint> thinned = ThinPoints(points, {}, most);
    EXPECT_LE(thinned.size(), most);
    if (most >= 500) {
      EXPECT_GT(thinned.size(), 0.9 * static_cast<double>(most)) << most;
    }
    for (const SeedPoint& point : thinned) {
      EXPECT_TRUE(point.is_dense);
      if (most >= 3000) {
        EXPECT_NEAR((point.position - Eigen::Vector3f(0.1f, 0, 0)).norm(), 0.8f, 0.01f);
      }
    }
    EXPECT_TRUE(SameBytes(ThinPoints(thinned, {}, most), thinned)) << "a second time";
  }
  EXPECT_TRUE(ThinPoints(points, {}, 0).empty());
}

TEST(ThinPoints, LeavesVoxelsOfOtherPointsAlone) {
  const std::vector<SeedPoint> points = Sphere(30'000);
  std::vector<Eigen::Vector3f> taken;
  for (size_t i = 0; i < 300; ++i) taken.push_back(points[i].position);
  const std::vector<SeedPoint> thinned = ThinPoints(points, taken, 3000);
  EXPECT_LE(thinned.size(), 3000u);
  EXPECT_GT(thinned.size(), 2700u);
  // About 4 pi 0.8^2 / 3300 of the sphere's area is one voxel's.
  size_t near = 0;
  for (const SeedPoint& point : thinned) {
    near += std::any_of(taken.begin(), taken.end(), [&](const Eigen::Vector3f& x) {
      return (x - point.position).norm() < 0.01f;
    });
  }
  EXPECT_LT(near, 30u);
  // Points that need no thinning lose exact copies alone.
  const std::vector<SeedPoint> few(points.begin(), points.begin() + 500);
  EXPECT_EQ(ThinPoints(few, taken, 500).size(), 200u);
}

// Two spheres of which the outer one has 100 times the area get sites as if it had some 11 times
// as many: voxels grow with the distance.
TEST(ThinPoints, IsCoarserFarAway) {
  std::vector<SeedPoint> points = Sphere(40'000, 0.8f);
  const std::vector<SeedPoint> outer = Sphere(40'000, 8);
  points.insert(points.end(), outer.begin(), outer.end());
  const std::vector<SeedPoint> thinned = ThinPoints(points, {}, 4000);
  const auto near = std::count_if(thinned.begin(), thinned.end(), [](const SeedPoint& point) {
    return point.position.norm() < 2;
  });
  // (1 + ln 8)^2 / 0.8^2 = 14.8.
  EXPECT_GT(near, 150);
  EXPECT_LT(near, 600);
}

TEST(ThinDenseSeeds, SfmPointsGoFirstAndStay) {
  std::vector<SeedPoint> seeds;
  for (SeedPoint point : Sphere(1000)) {
    point.is_dense = false;
    point.position.x() += 0.003f;
    seeds.push_back(point);
  }
  const std::vector<SeedPoint> dense = Sphere(20'000);
  seeds.insert(seeds.end(), dense.begin(), dense.end());
  const auto thinned_to = [&](size_t max_seed_sites, size_t max_point_sites) {
    InitializationOptions options;
    options.max_seed_sites = max_seed_sites;
    options.max_point_sites = max_point_sites;
    options.num_scattered = options.num_far = 0;
    const std::vector<SeedPoint> thinned = ThinDenseSeeds(seeds, options);
    EXPECT_TRUE(SameBytes({thinned.begin(), thinned.begin() + 1000},
                          {seeds.begin(), seeds.begin() + 1000}));
    EXPECT_EQ(std::count_if(thinned.begin(), thinned.end(), [](auto& s) { return !s.is_dense; }),
              1000);
    EXPECT_TRUE(SameBytes(ThinDenseSeeds(thinned, options), thinned)) << "a second time";
    return InitialFoam(thinned, {}, options).NumSites();
  };
  EXPECT_LE(thinned_to(5000, 4000), 4000u);
  EXPECT_GT(thinned_to(5000, 4000), 3700u);
  // Of SfM points that are thinned at random, those that stay count.
  EXPECT_LE(thinned_to(100, 4000), 4000u);
  EXPECT_GT(thinned_to(100, 4000), 3700u);
  EXPECT_EQ(thinned_to(5000, 900), 1000u);
}

}  // namespace
}  // namespace semfoam
