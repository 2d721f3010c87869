// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/surface_graph.h"

#include <algorithm>
#include <cstdint>

#include "tests/foam/segment/shown_scenes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(SurfaceGraph, HasNormalsOutOfTheMatter) {
  const SurfaceGraph graph = GraphOf(TwoBalls(0));
  ASSERT_GT(graph.NumNodes(), 500u);
  double worst = 1, sum = 0;
  for (uint32_t node = 0; node < graph.NumNodes(); ++node) {
    const double cosine = graph.normals[node].dot(graph.positions[node].normalized());
    worst = std::min(worst, cosine);
    sum += cosine;
  }
  EXPECT_GT(sum / static_cast<double>(graph.NumNodes()), 0.97);
  EXPECT_GT(worst, 0.6);
}

// Areas of cells a hundred times smaller are below what Eigen takes for zero.
TEST(SurfaceGraph, IsTheSameAtAnyScale) {
  constexpr float kScale = 0.01f;
  Model model = TwoBalls(0);
  const SurfaceGraph graph = GraphOf(model);
  for (Eigen::Vector3f& site : model.foam.positions) site *= kScale;
  for (float& raw_density : model.foam.raw_density) {
    if (raw_density > 0) raw_density = static_cast<float>(RawDensity(200 / kScale));
  }
  const SurfaceGraph small = GraphOf(model);
  ASSERT_EQ(small.cells, graph.cells);
  double worst = 1;
  for (uint32_t node = 0; node < graph.NumNodes(); ++node) {
    worst = std::min<double>(worst, small.normals[node].dot(graph.normals[node]));
  }
  EXPECT_GT(worst, 0.999);
}

}  // namespace
}  // namespace semfoam
