// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/expected_light.h"

#include "foam/util/random.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Photos on a ring that look at its middle, every eighth held out, and their lights.
struct Ring {
  explicit Ring(int count) {
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      PhotoRecord photo;
      photo.name = std::to_string(i) + ".jpg";
      photo.cam_from_world_rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY());
      photo.cam_from_world_translation = {0, 0, 2};
      photo.held_out = i % 8 == 0;
      photos.push_back(photo);
      lenses.push_back(0);
      angles.push_back(angle);
    }
    lights.resize(count);
  }

  ExpectedLights Expected() const { return {photos, lenses, lights}; }
  // What it must not look at.
  void SpoilHeldOut() {
    for (size_t i = 0; i < photos.size(); ++i) {
      if (photos[i].held_out) lights[i].gain = {9, 9, 9};
    }
  }

  std::vector<PhotoRecord> photos;
  std::vector<int> lenses;
  std::vector<double> angles;
  std::vector<PhotoLight> lights;
};

TEST(ExpectedLights, FollowsLightThatChangesFromPlaceToPlace) {
  Ring ring(64);
  for (size_t i = 0; i < 64; ++i) {
    ring.lights[i].gain.setConstant(std::exp(0.4 * std::sin(ring.angles[i])));
    ring.lights[i].shading(1, 0) = 0.3 * std::cos(ring.angles[i]);
  }
  const std::vector<PhotoLight> truth = ring.lights;
  ring.SpoilHeldOut();
  const ExpectedLights expected = ring.Expected();
  EXPECT_GT(expected.trust(), 0.95);
  for (size_t i = 0; i < 64; ++i) {
    const PhotoLight light = expected.OfPhoto(i);
    if (ring.photos[i].held_out) {
      EXPECT_NEAR(light.gain[2] / truth[i].gain[2], 1, 0.03) << i;
      EXPECT_NEAR(light.shading(1, 0), truth[i].shading(1, 0), 0.03) << i;
    } else {
      EXPECT_EQ(light.gain, truth[i].gain);
      EXPECT_EQ(light.shading, truth[i].shading);
    }
    // A view of no photo has the light of the place.
    const PhotoLight of_view = expected.At({ring.photos[i].cam_from_world_rotation, {0.01, 0, 2}});
    EXPECT_NEAR(of_view.gain[0] / truth[i].gain[0], 1, 0.06) << i;
  }
}

TEST(ExpectedLights, IsTheMeanWherePhotosHaveLightsOfTheirOwn) {
  Ring ring(400);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < 400; ++i) {
    CounterRandom random(1, 2, i);
    const Eigen::Vector3d log_gain = Eigen::Vector3d::Constant(0.2 + 0.3 * random.Normal());
    ring.lights[i].gain = log_gain.array().exp();
    if (!ring.photos[i].held_out) mean += log_gain / 350;
  }
  ring.SpoilHeldOut();
  const ExpectedLights expected = ring.Expected();
  EXPECT_LT(expected.trust(), 0.15);
  for (size_t i = 0; i < 400; i += 8) {
    EXPECT_NEAR(std::log(expected.OfPhoto(i).gain[0]), mean[0], 0.1) << i;
  }
}

TEST(ExpectedLights, KnowsLenses) {
  Ring ring(64);
  for (size_t i = 0; i < 64; ++i) {
    // Every eighth is of either.
    ring.lenses[i] = static_cast<int>((i + i / 8) % 2);
    const bool second = ring.lenses[i] == 1;
    ring.lights[i].gain = second ? Eigen::Vector3d(1.2, 1.0, 0.9) : Eigen::Vector3d(0.8, 1.0, 1.1);
    ring.lights[i].falloff = second ? Eigen::Vector2d(-0.3, -0.1) : Eigen::Vector2d(-0.1, 0);
  }
  const std::vector<PhotoLight> truth = ring.lights;
  ring.SpoilHeldOut();
  const ExpectedLights expected = ring.Expected();
  for (size_t i = 0; i < 64; i += 8) {
    EXPECT_LT((expected.OfPhoto(i).gain - truth[i].gain).norm(), 1e-9) << i;
    EXPECT_LT((expected.OfPhoto(i).falloff - truth[i].falloff).norm(), 1e-9) << i;
  }
  // Of a lens that no training photo has, the mean over all.
  ring.lenses[0] = 7;
  EXPECT_NEAR(ring.Expected().OfPhoto(0).gain[1], 1, 1e-9);
  EXPECT_NEAR(ring.Expected().OfPhoto(0).falloff[0], -0.2, 1e-9);
}

// One camera for each photo, as COLMAP has it by default for photos without EXIF data.
TEST(ExpectedLights, TakesLensesOfFewPhotosTogether) {
  Ring ring(64);
  for (size_t i = 0; i < 64; ++i) {
    ring.lenses[i] = static_cast<int>(i);
    ring.lights[i].gain.setConstant(std::exp(0.3 * std::sin(ring.angles[i])));
  }
  const std::vector<PhotoLight> truth = ring.lights;
  ring.SpoilHeldOut();
  for (size_t i = 0; i < 64; i += 8) {
    EXPECT_NEAR(ring.Expected().OfPhoto(i).gain[0] / truth[i].gain[0], 1, 0.03) << i;
  }
}

TEST(ExpectedLights, FewPhotosOrNone) {
  EXPECT_EQ(ExpectedLights({}, {}, {}).At(Pose()).gain, Eigen::Vector3d::Ones());
  Ring ring(2);
  ring.lights[1].gain = {1.5, 1.5, 1.5};
  // The only one that was trained on is what all are expected to be.
  EXPECT_NEAR(ring.Expected().OfPhoto(0).gain[0], 1.5, 1e-12);
  ring.photos[1].held_out = true;
  EXPECT_EQ(ring.Expected().OfPhoto(0).gain, Eigen::Vector3d::Ones());
  // A camera that turns about its centre.
  Ring turning(32);
  for (size_t i = 0; i < 32; ++i) {
    turning.photos[i].cam_from_world_translation.setZero();
    turning.lights[i].gain.setConstant(std::exp(0.3 * std::sin(turning.angles[i])));
  }
  EXPECT_NEAR(turning.Expected().OfPhoto(8).gain[0] / turning.lights[8].gain[0], 1, 0.05);
}

}  // namespace
}  // namespace semfoam
