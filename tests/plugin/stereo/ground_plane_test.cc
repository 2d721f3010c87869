// SPDX-License-Identifier: GPL-3.0-or-later
//
// The ground before a wall: all that is known is the wall, which stands far behind it.
#include "plugin/stereo/ground_plane.h"

#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/plugin/stereo/grey_views.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 300;
constexpr double kDegree = 3.14159265358979 / 180;
// The cameras are one unit above the ground and look along z; y is down.
constexpr double kWall = 10;
constexpr double kPost = 4;

struct Ground {
  // By which it falls to the right and towards the wall, in degrees.
  double roll = 0, pitch = 0;
  // Contrast of the borders between lawns and paths.
  double contrast = 0.3;
  // Pitch of the cameras, downwards.
  double camera_pitch = 8;
  int num_views = 7;

  Eigen::Vector3d Up() const {
    return Eigen::Vector3d(std::tan(roll * kDegree), -1, std::tan(pitch * kDegree)).normalized();
  }
  // Of the point below the middle of the cameras.
  double Level() const { return Up().dot(Eigen::Vector3d(0, 1, 0)); }
};

// A smooth random function of the plane, 0..1, that changes over one unit.
double Patches(const Eigen::Vector2d& at) {
  const Eigen::Vector2d cell = at.array().floor(), u = at - cell;
  double sum = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector2d step(corner & 1, corner >> 1);
    const Eigen::Vector2d index = cell + step;
    const double weight = (step.x() > 0 ? u.x() : 1 - u.x()) * (step.y() > 0 ? u.y() : 1 - u.y());
    const auto key =
        static_cast<uint64_t>(index.x() + 1000) * 4096 + static_cast<uint64_t>(index.y() + 1000);
    sum += weight * CounterRandom(3, 0x9a, key).Uniform();
  }
  return sum;
}

struct Scene {
  std::vector<StereoView> views;
  std::vector<ViewOverlap> overlaps;
  // The wall alone is known.
  std::vector<DepthMap> known;
  // [views][pixels] Inverse depth of the ground, 0 where something else is seen.
  std::vector<std::vector<double>> truth;
};

Scene Render(const Ground& ground) {
  Scene scene;
  for (int i = 0; i < ground.num_views; ++i) {
    StereoView view = PinholeView(i, kWidth, kHeight, kFocal);
    view.origin = {0.4 * (i - 3), 0, 0.1 * (i % 3)};
    view.cam_from_world =
        Eigen::AngleAxisd(ground.camera_pitch * kDegree, Eigen::Vector3d::UnitX()).matrix();
    DepthMap known;
    std::vector<double> truth;
    const auto light = [&](const Eigen::Vector3d& ray) {
      const double falls = -ground.Up().dot(ray);
      const double to_ground =
          falls > 0 ? (ground.Up().dot(view.origin) - ground.Level()) / falls : 1e9;
      double to_wall = (kWall - view.origin.z()) / ray.z();
      const Eigen::Vector3d at_post = view.origin + (kPost - view.origin.z()) / ray.z() * ray;
      const bool is_post = std::abs(at_post.x()) < 0.2 && at_post.y() > 0 && at_post.y() < 1.05;
      if (is_post) to_wall = (kPost - view.origin.z()) / ray.z();
      const bool is_ground = to_ground < to_wall;
      const Eigen::Vector3d at = view.origin + std::min(to_ground, to_wall) * ray;
      known.inverse.push_back(is_ground || is_post ? 0.f : static_cast<float>(1 / to_wall));
      truth.push_back(is_ground ? 1 / to_ground : 0);
      return 0.4 + (is_ground ? ground.contrast * (Patches({at.x(), at.z()}) > 0.5 ? 1 : 0)
                              : 0.4 * Patches({5 * at.x(), 5 * at.y()}));
    };
    AddPixelsOfRays(light, 0.02, &view);
    scene.views.push_back(view);
    scene.known.push_back(known);
    scene.truth.push_back(truth);
    ViewOverlap overlap;
    for (const int j : {i - 1, i + 1, i - 2, i + 2}) {
      if (j >= 0 && j < ground.num_views) overlap.partners.push_back(j);
    }
    overlap.depths.near = 1.5 / kWall;
    overlap.depths.far = 1 / (1.5 * kWall);
    scene.overlaps.push_back(overlap);
  }
  return scene;
}

std::optional<GroundPlane> Find(const Scene& scene) {
  return FindGroundPlane(scene.views, scene.overlaps, scene.known);
}

double DegreesBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

TEST(GroundPlane, IsFoundWhereItIs) {
  for (const auto& [roll, pitch] : {std::pair(0., 0.), {2., -1.}, {-1.5, 3.}}) {
    SCOPED_TRACE(testing::Message() << roll << ", " << pitch);
    Ground truth;
    truth.roll = roll;
    truth.pitch = pitch;
    const std::optional<GroundPlane> found = Find(Render(truth));
    ASSERT_TRUE(found);
    EXPECT_LT(DegreesBetween(found->up, truth.Up()), 0.4);
    // By a fiftieth of the cameras' height.
    EXPECT_NEAR(found->level, truth.Level(), 0.02);
    EXPECT_GT(found->agreement, found->agreement_beside + 0.15);
  }
}

TEST(GroundPlane, IsSeenAtItsDepth) {
  Ground truth;
  truth.roll = 1;
  const Scene scene = Render(truth);
  const LevelPlane plane{truth.Up(), truth.Level()};
  for (size_t k = 0; k < scene.views.size(); ++k) {
    const Eigen::Vector3d in_image = plane.InImage(scene.views[k]);
    for (size_t i = 0; i < scene.truth[k].size(); ++i) {
      if (!(scene.truth[k][i] > 0)) continue;
      const Eigen::Vector3d pixel(
          static_cast<double>(i % kWidth) + 0.5, static_cast<double>(i / kWidth) + 0.5, 1);
      // The truth is by rays of depth 1 along z.
      ASSERT_NEAR(in_image.dot(pixel), scene.truth[k][i], 1e-9);
    }
  }
}

// What has texture gets its depth, and what stands on the ground does not.
TEST(GroundPlane, GivesDepthsToTheGroundAlone) {
  const Scene scene = Render({});
  const std::optional<GroundPlane> ground = Find(scene);
  ASSERT_TRUE(ground);
  const std::vector<DepthMap> maps = AddGround(scene.views, scene.overlaps, *ground, scene.known);
  size_t num_ground = 0, num_right = 0, num_post = 0, num_wrong = 0;
  for (size_t k = 0; k < scene.views.size(); ++k) {
    const DepthMap& map = maps[k];
    for (size_t i = 0; i < map.inverse.size(); ++i) {
      if (scene.known[k].inverse[i] > 0) {
        ASSERT_EQ(map.inverse[i], scene.known[k].inverse[i]);
        continue;
      }
      const double truth = scene.truth[k][i];
      if (truth > 0) {
        ++num_ground;
        num_right += std::abs(map.inverse[i] - truth) <= 0.02 * truth;
        num_wrong += map.inverse[i] > 0 && std::abs(map.inverse[i] - truth) > 0.02 * truth;
      } else {
        ++num_post;
        num_wrong += map.inverse[i] > 0;
      }
    }
  }
  // Lawns are plain but for their borders.
  EXPECT_GT(num_right, num_ground / 5);
  EXPECT_LT(num_wrong, num_right / 15);
  EXPECT_LT(num_wrong, num_post / 2);
}

TEST(GroundPlane, NeedsSomethingToTellItBy) {
  Ground plain;
  plain.contrast = 0;
  EXPECT_FALSE(Find(Render(plain)));
}

TEST(GroundPlane, IsLeftToTheSweepWhereThatCanSeeIt) {
  Scene scene = Render({});
  for (ViewOverlap& overlap : scene.overlaps) overlap.depths.near = 1;
  EXPECT_FALSE(Find(scene));
}

TEST(GroundPlane, IsNotSoughtWhereItsDepthIsKnown) {
  Scene scene = Render({});
  for (size_t k = 0; k < scene.views.size(); ++k) {
    for (size_t i = 0; i < scene.truth[k].size(); ++i) {
      if (scene.truth[k][i] > 0) scene.known[k].inverse[i] = static_cast<float>(scene.truth[k][i]);
    }
  }
  EXPECT_FALSE(Find(scene));
}

TEST(GroundPlane, IsNotSoughtByCamerasThatLookDown) {
  Ground ground;
  ground.camera_pitch = 50;
  EXPECT_FALSE(Find(Render(ground)));
}

// What is known below a plane was seen through it.
TEST(GroundPlane, IsNoPlaneThatPhotosSeeThrough) {
  Scene scene = Render({});
  for (size_t k = 0; k < scene.views.size(); ++k) {
    // A strip at the left, in which the ground has an opening: its bottom is twice as far.
    for (size_t i = 0; i < scene.truth[k].size(); ++i) {
      if (scene.truth[k][i] > 0 && i % kWidth < kWidth / 8) {
        scene.known[k].inverse[i] = static_cast<float>(scene.truth[k][i] / 2);
      }
    }
  }
  EXPECT_FALSE(Find(scene));
}

TEST(GroundPlane, NeedsThreeViews) {
  Ground ground;
  ground.num_views = 2;
  EXPECT_FALSE(Find(Render(ground)));
  EXPECT_FALSE(FindGroundPlane({}, {}, {}));
}

TEST(GroundPlane, IsTheSameOnAnyNumberOfThreads) {
  Ground ground;
  ground.num_views = 4;
  const Scene scene = Render(ground);
  std::vector<GroundPlane> found;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    found.push_back(Find(scene).value());
  }
  for (const GroundPlane& plane : found) {
    EXPECT_EQ(plane.up, found[0].up);
    EXPECT_EQ(plane.level, found[0].level);
  }
}

}  // namespace
}  // namespace semfoam
