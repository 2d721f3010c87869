// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/normalized_frame.h"

#include "foam/geometry/guard_sites.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

std::vector<Viewpoint> Turntable(int count, double radius, const Vector3d& middle) {
  std::vector<Viewpoint> cameras;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count;
    const Vector3d offset(radius * std::cos(a), radius * std::sin(a), 0.4 * radius);
    cameras.push_back({middle + offset, -offset.normalized()});
  }
  return cameras;
}

std::vector<Vector3d> Ball(int count, double radius, const Vector3d& middle) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<Vector3d> points;
  while (static_cast<int>(points.size()) < count) {
    const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    if (p.norm() < 1) points.push_back(middle + radius * p);
  }
  return points;
}

double MedianCameraDistance(const Similarity& frame, const std::vector<Viewpoint>& cameras) {
  std::vector<double> distances;
  for (const Viewpoint& camera : cameras) distances.push_back(frame.Invert(camera.center).norm());
  std::sort(distances.begin(), distances.end());
  return distances[distances.size() / 2];
}

TEST(NormalizedFrame, TurntableWithTelephotoHasItsObjectInTheMiddle) {
  const Vector3d middle(1, 2, 3);
  const auto cameras = Turntable(36, 4, middle);
  const Similarity frame = NormalizedFrame(cameras, Ball(2000, 0.3, middle));
  EXPECT_LT((frame.translation - middle).norm(), 0.05);
  EXPECT_NEAR(MedianCameraDistance(frame, cameras), 1, 1e-9);
  // Without points the axes tell the same middle.
  EXPECT_LT((NormalizedFrame(cameras, {}).translation - middle).norm(), 1e-9);
}

TEST(NormalizedFrame, WildPointsAndCamerasChangeLittle) {
  auto cameras = Turntable(36, 4, Vector3d::Zero());
  auto points = Ball(2000, 1, Vector3d::Zero());
  const Similarity clean = NormalizedFrame(cameras, points);
  for (int i = 0; i < 200; ++i) points.push_back(Vector3d(1e6, -3e7, 1e9) * (i + 1));
  points.push_back(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  points.push_back(Vector3d::Constant(std::numeric_limits<double>::infinity()));
  cameras.push_back({Vector3d(80, 0, 0), Vector3d::UnitX()});
  const Similarity frame = NormalizedFrame(cameras, points);
  EXPECT_NEAR(frame.scale / clean.scale, 1, 0.15);
  EXPECT_LT((frame.translation - clean.translation).norm(), 0.2);
}

TEST(NormalizedFrame, EveryCameraStaysWellInsideTheGuards) {
  auto cameras = Turntable(36, 4, Vector3d::Zero());
  cameras.push_back({Vector3d(0, 0, 5000), -Vector3d::UnitZ()});
  const Similarity frame = NormalizedFrame(cameras, Ball(500, 1, Vector3d::Zero()));
  for (const Viewpoint& camera : cameras) {
    EXPECT_LE(frame.Invert(camera.center).norm(), 0.9001 * kFarRadius);
  }
}

TEST(NormalizedFrame, ScalesAndMovesWithItsInput) {
  const auto cameras = Turntable(20, 2, Vector3d(0.1, 0, 0));
  const auto points = Ball(1000, 1.5, Vector3d(0, 0.2, 0));
  const Similarity base = NormalizedFrame(cameras, points);
  for (const double scale : {1e-4, 1.0, 1e6}) {
    for (const Vector3d& offset : {Vector3d(0, 0, 0), Vector3d(5e5, 4.5e6, 300)}) {
      // Millimetres at UTM offsets are all that a double holds.
      if (scale < 1 && offset.norm() > 0) continue;
      auto moved_cameras = cameras;
      auto moved_points = points;
      for (Viewpoint& camera : moved_cameras) camera.center = scale * camera.center + offset;
      for (Vector3d& point : moved_points) point = scale * point + offset;
      const Similarity frame = NormalizedFrame(moved_cameras, moved_points);
      EXPECT_NEAR(frame.scale / (scale * base.scale), 1, 1e-8);
      EXPECT_LT((frame.Invert(scale * base.translation + offset)).norm(), 1e-8);
      // Back in the world to far better than a millimetre.
      const Vector3d there = moved_points[17];
      EXPECT_LT((frame.Apply(frame.Invert(there)) - there).norm(), 1e-8 * std::max(1.0, scale));
    }
  }
}

TEST(NormalizedFrame, RoomSeenFromItsMiddle) {
  // Cameras within half a metre look outwards at walls 3 m away: the walls must be near 1, not 6.
  auto cameras = Turntable(30, 0.3, Vector3d::Zero());
  for (Viewpoint& camera : cameras) camera.forward = -camera.forward;
  std::vector<Vector3d> walls = Ball(3000, 1, Vector3d::Zero());
  for (Vector3d& p : walls) p *= 3 / p.lpNorm<Eigen::Infinity>();
  const Similarity frame = NormalizedFrame(cameras, walls);
  EXPECT_LT(frame.translation.norm(), 0.5);
  EXPECT_GT(frame.scale, 0.9);
  EXPECT_LT(frame.scale, 2);
}

TEST(NormalizedFrame, CamerasInOnePlaceFallBackOnThePoints) {
  std::vector<Viewpoint> panorama(12, {Vector3d(5, 5, 5), Vector3d::UnitZ()});
  const auto points = Ball(2000, 9, Vector3d(5, 5, 5));
  const Similarity frame = NormalizedFrame(panorama, points);
  EXPECT_LT((frame.translation - Vector3d(5, 5, 5)).norm(), 1);
  EXPECT_GT(frame.scale, 1.5);
  EXPECT_LT(frame.scale, 4);
}

TEST(NormalizedFrame, OneCameraWithAndWithoutPoints) {
  const std::vector<Viewpoint> camera = {{Vector3d(1, 2, 3), Vector3d::UnitZ()}};
  const Similarity alone = NormalizedFrame(camera, {});
  EXPECT_EQ(alone.scale, 1);
  EXPECT_EQ(alone.translation, Vector3d(1, 2, 3));
  const Similarity seeing = NormalizedFrame(camera, Ball(100, 0.5, Vector3d(1, 2, 13)));
  EXPECT_NEAR(seeing.scale, 10, 0.5);
  const double utm = 4.5e6;
  const std::vector<Viewpoint> far(3, {Vector3d(utm, utm, utm), Vector3d::UnitZ()});
  EXPECT_EQ(NormalizedFrame(far, {Vector3d(utm, utm, utm)}).scale, 1);
}

TEST(NormalizedFrame, ParallelAxesWithoutPointsUseTheCameras) {
  std::vector<Viewpoint> row;
  for (int i = 0; i < 9; ++i) row.push_back({Vector3d(i, 0, 0), Vector3d::UnitZ()});
  const Similarity frame = NormalizedFrame(row, {});
  EXPECT_EQ(frame.translation, Vector3d(4, 0, 0));
  EXPECT_EQ(frame.scale, 2);
}

}  // namespace
}  // namespace semfoam
