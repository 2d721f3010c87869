// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/creases.h"

#include <algorithm>
#include <set>
#include <vector>

#include "tests/foam/segment/shown_scenes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

std::vector<int32_t> Cut(const SurfaceGraph& graph, double most_concave) {
  return CutAtCreases(
      graph, std::vector<uint8_t>(graph.NumNodes(), 1), most_concave, 0.01 * graph.TotalWeight());
}

TEST(Creases, OneBallIsOneRegion) {
  const std::vector<int32_t> regions = Cut(GraphOf(TwoBalls(0)), 0.1);
  EXPECT_EQ(std::set<int32_t>(regions.begin(), regions.end()), std::set<int32_t>{0});
}

TEST(Creases, BallsThatTouchAreTwo) {
  const SurfaceGraph graph = GraphOf(TwoBalls(0.75f));
  const std::vector<int32_t> regions = Cut(graph, 0.1);
  ASSERT_EQ(std::set<int32_t>(regions.begin(), regions.end()), (std::set<int32_t>{0, 1}));
  int64_t right = 0;
  for (uint32_t node = 0; node < graph.NumNodes(); ++node) {
    right += (graph.positions[node].x() > 0) == (regions[node] == 1);
  }
  const auto count = static_cast<int64_t>(graph.NumNodes());
  // Which of them is the first depends on the order of the sites.
  EXPECT_GT(std::max(right, count - right), 0.97 * static_cast<double>(count));
}

TEST(Creases, BallsThatTouchAreOneWhereCreasesMayBeDeep) {
  const std::vector<int32_t> regions = Cut(GraphOf(TwoBalls(0.75f)), 2);
  EXPECT_EQ(std::set<int32_t>(regions.begin(), regions.end()), std::set<int32_t>{0});
}

TEST(Creases, NodesOutsideHaveNoRegion) {
  const SurfaceGraph graph = GraphOf(TwoBalls(0));
  std::vector<uint8_t> is_in(graph.NumNodes(), 0);
  EXPECT_EQ(CutAtCreases(graph, is_in, 0.1, 0), std::vector<int32_t>(graph.NumNodes(), kNoRegion));
  is_in[0] = 1;
  const std::vector<int32_t> regions = CutAtCreases(graph, is_in, 0.1, 0);
  EXPECT_EQ(regions[0], 0);
  EXPECT_EQ(std::count(regions.begin(), regions.end(), kNoRegion), std::ssize(regions) - 1);
}

}  // namespace
}  // namespace semfoam
