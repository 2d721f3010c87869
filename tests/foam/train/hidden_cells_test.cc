// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/hidden_cells.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kNumSites = 600;

// A foam, what photos see of it, and its triangulation.
struct Scene {
  Foam foam;
  std::vector<float> transmittance;
  std::vector<Eigen::Vector3f> mean_color;
  Delaunay delaunay;

  bool IsAir(uint32_t i) const { return foam.raw_density[i] < RawDensity(1); }
  Eigen::Vector3f ColorAt(uint32_t i) const {
    const float* sh = &foam.sh[size_t{i} * foam.ShStride()];
    return Eigen::Vector3f(sh[0], sh[1], sh[2]) * static_cast<float>(kShDc) +
           Eigen::Vector3f::Constant(0.5f);
  }
};

// Random cells, every fourth of them air that rays pass. Of the others those with x > 0.2 are seen
// and the rest is hidden.
Scene RandomScene() {
  Scene scene;
  Foam& foam = scene.foam;
  foam.sh_degree = 1;
  foam.positions = RandomSites(kNumSites, 7);
  for (int i = 0; i < kNumSites; ++i) {
    CounterRandom random(7, 1, i);
    foam.raw_density.push_back(static_cast<float>(RawDensity(i % 4 == 0 ? 1e-6 : 500.0)));
    const float x = foam.positions[i].x();
    scene.transmittance.push_back(i % 4 == 0 || x > 0.2f ? 0.9f : 0.05f);
    Eigen::Vector3f color;
    for (int c = 0; c < 3; ++c) color[c] = static_cast<float>(random.Uniform());
    scene.mean_color.push_back(color);
    for (int c = 0; c < foam.ShStride(); ++c) {
      foam.sh.push_back(static_cast<float>(random.Uniform() - 0.5));
    }
    for (int c = 0; c < kColorGradientDim; ++c) {
      foam.color_gradient.push_back(static_cast<float>(random.Uniform() - 0.5));
    }
  }
  scene.delaunay = Triangulate(WithGuardSites(foam.positions));
  return scene;
}

int64_t Recolor(Scene* scene) {
  return RecolorHiddenCells(
      scene->delaunay, scene->transmittance, &scene->foam, &scene->mean_color);
}

TEST(HiddenCells, HaveTheMeanColourOfTheirOpaqueNeighbours) {
  const Scene before = RandomScene();
  Scene scene = before;
  const int64_t changed = Recolor(&scene);
  int64_t hidden = 0;
  for (uint32_t i = 0; i < kNumSites; ++i) {
    if (before.transmittance[i] >= kHiddenTransmittance) {
      EXPECT_EQ(scene.mean_color[i], before.mean_color[i]);
      EXPECT_EQ(scene.ColorAt(i), before.ColorAt(i));
      continue;
    }
    ++hidden;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (const uint32_t j : scene.delaunay.Neighbors(i)) {
      if (j >= kNumSites || scene.IsAir(j)) continue;
      sum += scene.mean_color[j];
      ++count;
    }
    ASSERT_GT(count, 0);
    EXPECT_LT((scene.mean_color[i] - sum / count).cwiseAbs().maxCoeff(), 1e-3f) << i;
    EXPECT_LT((scene.ColorAt(i) - scene.mean_color[i]).cwiseAbs().maxCoeff(), 1e-5f);
    const float* sh = &scene.foam.sh[size_t{i} * scene.foam.ShStride()];
    EXPECT_TRUE(std::all_of(sh + 3, sh + scene.foam.ShStride(), [](float c) { return c == 0; }));
    const float* gradient = &scene.foam.color_gradient[size_t{i} * kColorGradientDim];
    EXPECT_TRUE(
        std::all_of(gradient, gradient + kColorGradientDim, [](float c) { return c == 0; }));
  }
  EXPECT_EQ(changed, hidden);
  EXPECT_GT(hidden, 100);
  EXPECT_EQ(scene.foam.raw_density, before.foam.raw_density);
}

TEST(HiddenCells, PassColoursThroughAirThatNoRayMeets) {
  // A row of cells; the last is opaque and seen, the first is opaque and hidden, air is between.
  Scene scene;
  for (int i = 0; i < 6; ++i) {
    scene.foam.positions.emplace_back(0.1f * i, 0.01f * (i % 2), 0.01f * (i % 3));
    const bool is_air = i > 0 && i < 5;
    scene.foam.raw_density.push_back(static_cast<float>(RawDensity(is_air ? 1e-6 : 500.0)));
    scene.transmittance.push_back(i == 0 ? 0.01f : i == 5 ? 1.f : 0.f);
    scene.mean_color.emplace_back(i == 5 ? 0.75f : 0.25f, 0.5f, 0.5f);
    for (int c = 0; c < 3; ++c) scene.foam.sh.push_back(1.f);
  }
  scene.delaunay = Triangulate(WithGuardSites(scene.foam.positions));
  EXPECT_EQ(Recolor(&scene), 1);
  EXPECT_NEAR(scene.mean_color[0].x(), 0.75f, 1e-4f);
  EXPECT_NEAR(scene.ColorAt(0).x(), 0.75f, 1e-4f);
  EXPECT_EQ(scene.mean_color[1].x(), 0.25f);
}

TEST(HiddenCells, AreLargeWhereNoRayMeetsThem) {
  Scene scene = RandomScene();
  const std::vector<float> radii = CellRadii(WithGuardSites(scene.foam.positions), scene.delaunay);
  // Of the seen cells that have only sites around them, the smallest and the largest.
  uint32_t small = kNoCell, large = kNoCell;
  for (uint32_t i = 0; i < kNumSites; ++i) {
    const auto around = scene.delaunay.Neighbors(i);
    if (scene.IsAir(i) || scene.transmittance[i] < kHiddenTransmittance) continue;
    if (std::any_of(around.begin(), around.end(), [](uint32_t j) { return j >= kNumSites; })) {
      continue;
    }
    if (small == kNoCell || radii[i] < radii[small]) small = i;
    if (large == kNoCell || radii[i] > radii[large]) large = i;
  }
  ASSERT_NE(small, large);
  scene.transmittance[small] = scene.transmittance[large] = 0;
  const Scene before = scene;
  Recolor(&scene);
  EXPECT_EQ(scene.mean_color[small], before.mean_color[small]);
  EXPECT_EQ(scene.ColorAt(small), before.ColorAt(small));
  EXPECT_NE(scene.mean_color[large], before.mean_color[large]);
}

TEST(HiddenCells, StayWhereNoSeenCellIs) {
  Scene scene = RandomScene();
  std::fill(scene.transmittance.begin(), scene.transmittance.end(), 0.05f);
  const Scene before = scene;
  EXPECT_EQ(Recolor(&scene), 0);
  EXPECT_EQ(scene.mean_color, before.mean_color);
  EXPECT_EQ(scene.foam.sh, before.foam.sh);
}

TEST(HiddenCells, WithoutAnyNothingChanges) {
  Scene scene = RandomScene();
  std::fill(scene.transmittance.begin(), scene.transmittance.end(), 1.f);
  EXPECT_EQ(Recolor(&scene), 0);
}

TEST(HiddenCells, AreTheSameOnAnyNumberOfThreads) {
  const auto recolored = [](int threads) {
    const ThreadLimit limit(threads);
    Scene scene = RandomScene();
    Recolor(&scene);
    return scene.foam.sh;
  };
  const auto one = recolored(1);
  for (const int threads : {2, 5}) EXPECT_EQ(recolored(threads), one);
}

}  // namespace
}  // namespace semfoam
