// SPDX-License-Identifier: GPL-3.0-or-later
//
// A box on a plain table: all that is known are the sides of the box. Its lid is as plain as the
// table, and of another colour.
#include "plugin/stereo/support_plane.h"

#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "tests/plugin/stereo/grey_views.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kWidth = 320, kHeight = 240, kNumViews = 12;
constexpr double kFocal = 300;
constexpr double kDegree = 3.14159265358979 / 180;
// The box reaches from the table, z = 0, to z = kTall, and kHalf to all sides. The table ends at a
// circle, below which is the dark floor.
constexpr double kHalf = 0.5, kTall = 0.6, kTable = 4, kFloor = -3;
constexpr double kDistance = 3.5;

enum class Seen { kTable, kSide, kLid, kFloor };

struct Hit {
  Seen seen = Seen::kFloor;
  double along = std::numeric_limits<double>::infinity();
};

// Returns what a ray from above meets first.
Hit Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  Hit hit;
  const auto meet = [&](Seen seen, double along, auto&& contains) {
    if (along > 0 && along < hit.along && contains(origin + along * ray)) hit = {seen, along};
  };
  meet(Seen::kFloor, (kFloor - origin.z()) / ray.z(), [](const auto&) { return true; });
  meet(Seen::kTable, -origin.z() / ray.z(), [](const auto& x) {
    return x.template head<2>().norm() < kTable;
  });
  meet(Seen::kLid, (kTall - origin.z()) / ray.z(), [](const auto& x) {
    return x.template head<2>().cwiseAbs().maxCoeff() <= kHalf;
  });
  for (int axis = 0; axis < 2; ++axis) {
    for (const double side : {-kHalf, kHalf}) {
      meet(Seen::kSide, (side - origin[axis]) / ray[axis], [axis](const auto& x) {
        return std::abs(x[1 - axis]) <= kHalf && x.z() >= 0 && x.z() <= kTall;
      });
    }
  }
  return hit;
}

struct Scene {
  std::vector<StereoView> views;
  std::vector<ViewOverlap> overlaps;
  // The sides of the box alone are known.
  std::vector<DepthMap> known;
  std::vector<Eigen::Vector3f> points;
  // [views][pixels]
  std::vector<std::vector<Hit>> truth;
};

struct Table {
  // How much of the table's light differs from place to place.
  double shade = 0.05;
  // How much brighter each photo is than the one before, and darker again.
  double gain = 1;
  // The part of the circle around the box that cameras stand on.
  double arc = 360 * kDegree;
};

Scene Render(const Table& table) {
  Scene scene;
  for (int i = 0; i < kNumViews; ++i) {
    const double turn = table.arc * i / kNumViews;
    StereoView view = PinholeView(i, kWidth, kHeight, kFocal);
    view.origin = {kDistance * std::cos(turn), kDistance * std::sin(turn), 2 + 0.3 * (i % 3)};
    const Eigen::Vector3d forward = -view.origin.normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    view.cam_from_world.row(0) = right;
    view.cam_from_world.row(1) = forward.cross(right);
    view.cam_from_world.row(2) = forward;
    const double gain = i % 2 == 0 ? 1 : table.gain;
    DepthMap known;
    std::vector<Hit> truth;
    const auto light = [&](const Eigen::Vector3d& ray) {
      const Hit hit = Cast(view.origin, ray);
      const Eigen::Vector3d at = view.origin + hit.along * ray;
      // Rays have depth 1 along z.
      known.inverse.push_back(hit.seen == Seen::kSide ? static_cast<float>(1 / hit.along) : 0.f);
      if (hit.seen == Seen::kSide && truth.size() % 7 == 0) {
        scene.points.push_back(at.cast<float>());
      }
      truth.push_back(hit);
      switch (hit.seen) {
        case Seen::kTable:
          return gain * (0.7 + table.shade * std::sin(at.x() + 2 * at.y()));
        case Seen::kSide:
          return gain * (0.4 + 0.2 * std::sin(40 * at.x() + 55 * at.y()));
        case Seen::kLid:
          return gain * 0.45;
        case Seen::kFloor:
          break;
      }
      return gain * 0.2;
    };
    AddPixelsOfRays(light, 0.01, &view);
    scene.views.push_back(view);
    scene.known.push_back(known);
    scene.truth.push_back(truth);
    ViewOverlap overlap;
    for (int j = 0; j < kNumViews; ++j) {
      if (j != i) overlap.partners.push_back(j);
    }
    scene.overlaps.push_back(overlap);
  }
  return scene;
}

std::optional<LevelPlane> Find(const Scene& scene) {
  return FindSupportPlane(scene.views, scene.points, scene.known);
}

TEST(SupportPlane, IsWhereThePointsEnd) {
  Scene scene = Render({});
  // A few points are wrong.
  CounterRandom random(4, 0x77, 0);
  for (size_t i = 0; i < scene.points.size() / 100; ++i) {
    scene.points.emplace_back(random.Uniform() - 0.5, random.Uniform() - 0.5, -random.Uniform());
  }
  const std::optional<LevelPlane> found = Find(scene);
  ASSERT_TRUE(found);
  EXPECT_GT(found->up.z(), std::cos(1 * kDegree));
  EXPECT_NEAR(found->level, 0, 0.01);
}

TEST(SupportPlane, GivesDepthsToTheTableAlone) {
  for (const double gain : {1.0, 1.25}) {
    SCOPED_TRACE(gain);
    const Scene scene = Render({.gain = gain});
    const std::optional<LevelPlane> plane = Find(scene);
    ASSERT_TRUE(plane);
    const std::vector<DepthMap> maps =
        AddSupport(scene.views, scene.overlaps, *plane, scene.points, scene.known);
    size_t num_table = 0, num_right = 0, num_given = 0;
    for (size_t k = 0; k < maps.size(); ++k) {
      for (size_t i = 0; i < maps[k].inverse.size(); ++i) {
        const float inverse = maps[k].inverse[i];
        if (scene.known[k].inverse[i] > 0) {
          ASSERT_EQ(inverse, scene.known[k].inverse[i]);
          continue;
        }
        const Hit& truth = scene.truth[k][i];
        const bool is_table = truth.seen == Seen::kTable;
        num_table += is_table;
        num_given += inverse > 0;
        num_right += is_table && inverse > 0 && std::abs(inverse * truth.along - 1) < 0.02;
      }
    }
    EXPECT_GT(num_right, 7 * num_table / 10);
    EXPECT_LT(num_given - num_right, num_right / 50);
  }
}

// As many points of a ball lie at any height.
TEST(SupportPlane, IsNotThatOfABall) {
  Scene scene = Render({});
  scene.points.clear();
  for (int i = 0; i < 20'000; ++i) {
    CounterRandom random(4, 0x78, i);
    const Eigen::Vector3d normal(random.Normal(), random.Normal(), random.Normal());
    scene.points.push_back((0.5 * normal.normalized()).cast<float>());
  }
  EXPECT_FALSE(Find(scene));
}

// Their lower edges are on many planes.
TEST(SupportPlane, IsNotThatOfOneSide) {
  Scene scene = Render({});
  std::erase_if(scene.points, [](const auto& x) { return x.x() < 0.99 * kHalf; });
  EXPECT_FALSE(Find(scene));
}

TEST(SupportPlane, IsNotSoughtWhereItsDepthIsKnown) {
  Scene scene = Render({});
  for (size_t k = 0; k < scene.views.size(); ++k) {
    for (size_t i = 0; i < scene.truth[k].size(); i += 2) {
      if (scene.truth[k][i].seen == Seen::kTable) {
        scene.known[k].inverse[i] = static_cast<float>(1 / scene.truth[k][i].along);
      }
    }
  }
  EXPECT_FALSE(Find(scene));
}

// Light that moves with the camera, or a plane that is not there.
TEST(SupportPlane, GivesNothingWherePhotosDiffer) {
  Scene scene = Render({});
  const std::optional<LevelPlane> plane = Find(scene);
  ASSERT_TRUE(plane);
  for (StereoView& view : scene.views) {
    for (size_t i = 0; i < view.color.size(); ++i) {
      const double wave = 0.25 * std::sin(view.CenterOf(i).x() / 40 + 2 * view.view);
      view.color[i].array() += static_cast<float>(wave);
    }
  }
  const std::vector<DepthMap> maps =
      AddSupport(scene.views, scene.overlaps, *plane, scene.points, scene.known);
  size_t num_given = 0, num_pixels = 0;
  for (size_t k = 0; k < maps.size(); ++k) {
    for (size_t i = 0; i < maps[k].inverse.size(); ++i) {
      num_given += maps[k].inverse[i] > 0 && scene.known[k].inverse[i] == 0;
      ++num_pixels;
    }
  }
  EXPECT_LT(num_given, num_pixels / 20);
}

TEST(SupportPlane, NeedsPointsAndViews) {
  Scene scene = Render({});
  scene.points.resize(100);
  EXPECT_FALSE(Find(scene));
  EXPECT_FALSE(FindSupportPlane({}, {}, {}));
}

TEST(SupportPlane, IsTheSameOnAnyNumberOfThreads) {
  const Scene scene = Render({});
  std::vector<LevelPlane> planes;
  std::vector<std::vector<DepthMap>> maps;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    planes.push_back(Find(scene).value());
    maps.push_back(
        AddSupport(scene.views, scene.overlaps, planes.back(), scene.points, scene.known));
  }
  for (size_t t = 1; t < planes.size(); ++t) {
    EXPECT_EQ(planes[t].up, planes[0].up);
    EXPECT_EQ(planes[t].level, planes[0].level);
    for (size_t k = 0; k < maps[0].size(); ++k) EXPECT_EQ(maps[t][k].inverse, maps[0][k].inverse);
  }
}

}  // namespace
}  // namespace semfoam
