// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/upward.h"

#include "foam/util/random.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

double AngleDegrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

// Of a world whose z is up, turned by `world`: a camera that looks along the yaw, down by the
// pitch, rolled about its axis. All in degrees.
Eigen::Quaterniond Camera(double yaw,
                          double pitch,
                          double roll,
                          const Eigen::Quaterniond& world = Eigen::Quaterniond::Identity()) {
  // x to the right, y down, z forwards.
  Eigen::Matrix3d level;
  level << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(roll * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      Eigen::AngleAxisd(pitch * kDegree, Eigen::Vector3d::UnitX()).toRotationMatrix() * level *
      Eigen::AngleAxisd(-yaw * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return Eigen::Quaterniond(turned) * world.conjugate();
}

const Eigen::Quaterniond kWorld(Eigen::AngleAxisd(0.7, Eigen::Vector3d(2, -1, 0.4).normalized()));
const Eigen::Vector3d kUp = kWorld * Eigen::Vector3d::UnitZ();

TEST(Upward, HalfARingOfPhotosTellsUpExactly) {
  std::vector<Eigen::Quaterniond> cameras;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < 30; ++i) {
    CounterRandom random(1, 1, i);
    cameras.push_back(Camera(-60 + 4 * i, 45, random.Normal(), kWorld));
    mean -= cameras.back().conjugate() * Eigen::Vector3d::UnitY();
  }
  const std::optional<CameraUp> up = UpOfCameras(cameras);
  ASSERT_TRUE(up);
  EXPECT_TRUE(up->by_horizon);
  EXPECT_LT(AngleDegrees(up->up, kUp), 0.5);
  EXPECT_LT(up->spread_degrees, 1.5);
  // The mean of the upward directions would not.
  EXPECT_GT(AngleDegrees(mean, kUp), 25);
}

TEST(Upward, SomePortraitPhotosAreOutliers) {
  std::vector<Eigen::Quaterniond> cameras;
  for (int i = 0; i < 40; ++i) cameras.push_back(Camera(9 * i, 20, i % 4 == 0 ? 90 : 0, kWorld));
  EXPECT_LT(AngleDegrees(UpOfCameras(cameras)->up, kUp), 0.1);
}

TEST(Upward, CamerasUpsideDownTurnItOver) {
  std::vector<Eigen::Quaterniond> cameras;
  for (int i = 0; i < 12; ++i) cameras.push_back(Camera(30 * i, 10, 180, kWorld));
  EXPECT_LT(AngleDegrees(UpOfCameras(cameras)->up, -kUp), 0.1);
}

TEST(Upward, ViewsStraightDownHaveTheSkyBehindThem) {
  // There and back: upward directions cancel out. A few looks are slanted.
  std::vector<Eigen::Quaterniond> cameras;
  for (int i = 0; i < 20; ++i) cameras.push_back(Camera(i % 2 == 0 ? 0 : 180, 90, 0.2 * i, kWorld));
  for (int i = 0; i < 20; ++i) cameras.push_back(Camera(18 * i, 90, 0, kWorld));
  const std::optional<CameraUp> up = UpOfCameras(cameras);
  ASSERT_TRUE(up);
  EXPECT_LT(AngleDegrees(up->up, kUp), 1);
}

TEST(Upward, ViewsToOneSideGiveTheirMean) {
  std::vector<Eigen::Quaterniond> cameras;
  for (int i = 0; i < 9; ++i) cameras.push_back(Camera(0, -20 + 5 * i, 0, kWorld));
  cameras.push_back(Camera(0, 0, 170, kWorld));  // one outlier
  const std::optional<CameraUp> up = UpOfCameras(cameras);
  ASSERT_TRUE(up);
  EXPECT_FALSE(up->by_horizon);
  EXPECT_LT(AngleDegrees(up->up, kUp), 3);
  EXPECT_NEAR(up->spread_degrees, 15, 0.1);
}

TEST(Upward, PhotosMayNotTell) {
  EXPECT_FALSE(UpOfCameras({}));
  EXPECT_FALSE(UpOfCameras({Camera(0, 0, 0), Camera(0, 0, 180)}));
  EXPECT_TRUE(UpOfCameras({Camera(0, 0, 0)}));
}

}  // namespace
}  // namespace semfoam
