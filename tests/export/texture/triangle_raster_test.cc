// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/triangle_raster.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(TriangleRaster, NearestTriangleByTheReciprocalOfTheDistance) {
  const std::vector<ImageVertex> vertices = {
      {{0, 0}, 2}, {{8, 0}, 4}, {{0, 8}, 2}, {{0, 0}, 3}, {{8, 0}, 3}, {{8, 8}, 3}, {{0, 8}, 3}};
  const std::vector<std::array<uint32_t, 3>> triangles = {{3, 4, 5}, {3, 5, 6}, {0, 1, 2}};
  const TriangleRaster raster = DrawTriangles(vertices, triangles, 10, 8);
  const auto at = [&](int x, int y) { return static_cast<size_t>(y * 10 + x); };
  EXPECT_EQ(raster.triangle[at(0, 0)], 2u);
  // At x = 6.5 the third triangle is at 1 / (1.5 / 16 + 6.5 / 32), more than 3.
  EXPECT_EQ(raster.triangle[at(6, 0)], 0u);
  EXPECT_FLOAT_EQ(raster.distance[at(6, 0)], 3);
  EXPECT_NEAR(raster.distance[at(0, 0)], 1 / (7.5 / 16 + 0.5 / 32), 1e-6);
  EXPECT_EQ(raster.triangle[at(8, 3)], kNoTriangle);
  EXPECT_TRUE(std::isinf(raster.distance[at(8, 3)]));
}

// Each pixel of a square belongs to one of its halves, whichever way they turn.
TEST(TriangleRaster, SharedSidesLeaveNoGaps) {
  const std::vector<ImageVertex> vertices = {
      {{1.3, 0.7}, 1}, {{30.1, 2.2}, 1}, {{28.9, 29.5}, 1}, {{2.6, 31.4}, 1}, {{4, 4}, 0}};
  const std::vector<std::array<uint32_t, 3>> triangles = {{0, 1, 2}, {0, 3, 2}};
  const TriangleRaster raster = DrawTriangles(vertices, triangles, 32, 32);
  for (int y = 3; y < 29; ++y) {
    for (int x = 3; x < 28; ++x) EXPECT_NE(raster.triangle[y * 32 + x], kNoTriangle);
  }
}

// Slivers, and triangles that reach far beyond the image.
TEST(TriangleRaster, CoversThePixelsThatTheSidesEnclose) {
  constexpr int kWidth = 40, kFirstRow = 5, kEndRow = 27;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(-1, 1);
  for (int round = 0; round < 2000; ++round) {
    const double size = std::pow(10.0, 1 + round % 6);
    std::array<Eigen::Vector2d, 3> corners;
    for (Eigen::Vector2d& corner : corners) {
      corner = {20 + size * share(random), 15 + size * share(random)};
    }
    if (round % 5 == 0) corners[1].y() = corners[0].y();
    if (round % 3 == 0) {
      corners[2] = corners[0] + 1.001 * (corners[1] - corners[0]) + Eigen::Vector2d(0.7, 0.3);
    }
    std::set<std::pair<int, int>> covered, enclosed;
    ForEachCoveredPixel(
        corners, kWidth, kFirstRow, kEndRow, [&](int x, int y, const Eigen::Vector3d& weights) {
          EXPECT_TRUE(covered.emplace(x, y).second);
          EXPECT_NEAR(weights.sum(), 1, 1e-9);
        });
    for (int y = kFirstRow; y < kEndRow; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector2d place(x + 0.5, y + 0.5);
        if (CornerWeights(corners, place).minCoeff() >= 0) enclosed.emplace(x, y);
      }
    }
    EXPECT_EQ(covered, enclosed) << "round " << round;
  }
}

TEST(TriangleRaster, TrianglesBehindTheCameraAreLeftOut) {
  const std::vector<ImageVertex> vertices = {{{0, 0}, 1}, {{9, 0}, 1}, {{0, 9}, 0}};
  const std::vector<std::array<uint32_t, 3>> triangles = {{0, 1, 2}};
  const TriangleRaster raster = DrawTriangles(vertices, triangles, 9, 9);
  EXPECT_TRUE(std::all_of(
      raster.triangle.begin(), raster.triangle.end(), [](uint32_t f) { return f == kNoTriangle; }));
}

TEST(TriangleRaster, WeightsOfCorners) {
  const std::array<Eigen::Vector2d, 3> corners = {
      Eigen::Vector2d(1, 1), Eigen::Vector2d(5, 1), Eigen::Vector2d(1, 3)};
  EXPECT_TRUE(CornerWeights(corners, {1, 1}).isApprox(Eigen::Vector3d(1, 0, 0)));
  EXPECT_TRUE(CornerWeights(corners, {3, 2}).isApprox(Eigen::Vector3d(0, 0.5, 0.5)));
  EXPECT_EQ(CornerWeights({corners[0], corners[0], corners[1]}, {2, 2}), Eigen::Vector3d(1, 0, 0));
}

}  // namespace
}  // namespace semfoam
