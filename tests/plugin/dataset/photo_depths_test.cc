// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/photo_depths.h"

#include <utility>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kWidth = 12, kHeight = 9;

// Depths of a plane n . x = 1 in the camera's frame.
PhotoDepths DepthsOfPlane(const Eigen::Vector3f& n) {
  PhotoDepths depths;
  depths.width = kWidth;
  depths.height = kHeight;
  depths.focal = {10, 11};
  depths.center = {6.2f, 4.4f};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Eigen::Vector2f at = Eigen::Vector2f(x + 0.5f, y + 0.5f) - depths.center;
      depths.inverse.push_back(n.dot(at.cwiseQuotient(depths.focal).homogeneous()));
    }
  }
  return depths;
}

Eigen::Vector3f DirectionTo(const PhotoDepths& depths, float x, float y) {
  return (Eigen::Vector2f(x, y) - depths.center)
      .cwiseQuotient(depths.focal)
      .homogeneous()
      .normalized();
}

TEST(PhotoDepths, AreExactOnPlanes) {
  const Eigen::Vector3f n(0.05f, -0.07f, 0.5f);
  const PhotoDepths depths = DepthsOfPlane(n);
  for (const auto& [x, y] : {std::pair(0.5f, 0.5f), {3.f, 4.f}, {7.77f, 2.13f}, {11.4f, 8.4f}}) {
    const Eigen::Vector3f direction = DirectionTo(depths, x, y);
    EXPECT_NEAR(depths.DistanceAlong(direction) * n.dot(direction), 1, 1e-5) << x << " " << y;
  }
}

TEST(PhotoDepths, AreUnknownOutsideAndBehind) {
  const PhotoDepths depths = DepthsOfPlane({0, 0, 0.5f});
  for (const auto& [x, y] : {std::pair(0.4f, 3.f), {3.f, 0.4f}, {11.6f, 3.f}, {3.f, 8.6f}}) {
    EXPECT_EQ(depths.DistanceAlong(DirectionTo(depths, x, y)), 0) << x << " " << y;
  }
  EXPECT_EQ(depths.DistanceAlong(-DirectionTo(depths, 6, 4)), 0);
  EXPECT_EQ(depths.DistanceAlong({1, 0, 0}), 0);
  EXPECT_EQ(PhotoDepths().DistanceAlong({0, 0, 1}), 0);
}

TEST(PhotoDepths, AreUnknownBesideWhatIsUnknownAndBetweenTwoSurfaces) {
  PhotoDepths depths = DepthsOfPlane({0, 0, 0.5f});
  depths.inverse[3 * kWidth + 4] = 0;
  depths.inverse[6 * kWidth + 8] = 0.53f;
  for (const auto& [x, y] : {std::pair(4.f, 4.f), {5.f, 3.f}, {8.f, 7.f}, {9.f, 6.f}}) {
    EXPECT_EQ(depths.DistanceAlong(DirectionTo(depths, x, y)), 0) << x << " " << y;
  }
  EXPECT_GT(depths.DistanceAlong(DirectionTo(depths, 6, 4)), 0);
  EXPECT_GT(depths.DistanceAlong(DirectionTo(depths, 7, 6)), 0);
}

}  // namespace
}  // namespace semfoam
