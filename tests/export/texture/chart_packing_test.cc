// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/chart_packing.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

std::vector<Eigen::Vector2d> RandomSizes(int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> size(0.05, 1);
  std::vector<Eigen::Vector2d> sizes;
  for (int i = 0; i < count; ++i) {
    const double x = size(random), y = size(random);
    sizes.emplace_back(x, y);
  }
  return sizes;
}

// Expects that the rectangles, margins included, lie in the square and do not overlap.
void ExpectApart(const ChartPacking& packing, const std::vector<Eigen::Vector2d>& sizes) {
  ASSERT_EQ(packing.offsets.size(), sizes.size());
  std::vector<uint8_t> is_taken(static_cast<size_t>(packing.size) * packing.size, 0);
  for (size_t c = 0; c < sizes.size(); ++c) {
    const Eigen::Vector2d low = packing.offsets[c].array() - kChartMargin;
    const Eigen::Vector2d high =
        packing.offsets[c] + packing.scale * sizes[c] + Eigen::Vector2d::Constant(kChartMargin);
    ASSERT_GE(low.minCoeff(), 0);
    ASSERT_LE(high.maxCoeff(), packing.size);
    for (int y = static_cast<int>(low.y()); y < std::ceil(high.y()); ++y) {
      for (int x = static_cast<int>(low.x()); x < std::ceil(high.x()); ++x) {
        uint8_t& taken = is_taken[static_cast<size_t>(y) * packing.size + x];
        ASSERT_EQ(taken, 0) << x << " " << y;
        taken = 1;
      }
    }
  }
}

TEST(ChartPacking, WantedScaleInTheSmallestSquare) {
  const std::vector<Eigen::Vector2d> sizes = RandomSizes(40);
  const ChartPacking packing = PackCharts(sizes, 50, 4096);
  EXPECT_EQ(packing.scale, 50);
  EXPECT_EQ(packing.size, 256);
  ExpectApart(packing, sizes);
}

TEST(ChartPacking, SmallerScaleWhereTheSquareIsFull) {
  const std::vector<Eigen::Vector2d> sizes = RandomSizes(200);
  double area = 0;
  for (const Eigen::Vector2d& size : sizes) area += size.prod();
  const ChartPacking packing = PackCharts(sizes, 1000, 1000);
  EXPECT_EQ(packing.size, 1000);
  EXPECT_LT(packing.scale, 1000);
  ExpectApart(packing, sizes);
  EXPECT_GT(area * packing.scale * packing.scale, 0.55 * 1000 * 1000);
}

TEST(ChartPacking, OneFlatChart) {
  const std::vector<Eigen::Vector2d> sizes = {{3, 0}};
  const ChartPacking packing = PackCharts(sizes, 10, 2048);
  EXPECT_EQ(packing.size, kLeastTextureSize);
  ExpectApart(packing, sizes);
}

}  // namespace
}  // namespace semfoam
