// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/hidden_cells.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/render/cell_shading.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kNumSites = 600;

// A foam, what photos see of it, and its triangulation.
struct Scene {
  Foam foam;
  CellMeasurements measured;
  Delaunay delaunay;

  bool IsAir(uint32_t i) const { return foam.raw_density[i] < RawDensity(1); }
  bool IsHidden(uint32_t i) const { return measured.weight[i] < 0.05f; }
  const Eigen::Vector3f& MeanColor(uint32_t i) const { return measured.statistics.mean_color[i]; }
  Eigen::Vector3f ColorAt(uint32_t i) const {
    const float* sh = &foam.sh[size_t{i} * foam.ShStride()];
    return Eigen::Vector3f(sh[0], sh[1], sh[2]) * static_cast<float>(kShDc) +
           Eigen::Vector3f::Constant(0.5f);
  }

  // Adds what 100 rays that could meet the next cell see of it.
  void AddMeasurement(float weight, float transmittance, const Eigen::Vector3f& color) {
    measured.potential_rays.push_back(100);
    measured.weight.push_back(weight);
    measured.transmittance.push_back(transmittance);
    measured.statistics.mean_color.push_back(color);
  }
};

// Random cells, every fourth of them air that rays pass. Of the others those with x > 0.2 are seen
// and the rest is hidden, but not unseen.
Scene RandomScene() {
  Scene scene;
  Foam& foam = scene.foam;
  foam.sh_degree = 1;
  foam.positions = RandomSites(kNumSites, 7);
  for (int i = 0; i < kNumSites; ++i) {
    CounterRandom random(7, 1, i);
    foam.raw_density.push_back(static_cast<float>(RawDensity(i % 4 == 0 ? 1e-6 : 500.0)));
    Eigen::Vector3f color;
    for (int c = 0; c < 3; ++c) color[c] = static_cast<float>(random.Uniform());
    const bool is_seen = i % 4 == 0 || foam.positions[i].x() > 0.2f;
    scene.AddMeasurement(is_seen ? 30.f : 0.01f, 0.9f, color);
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

HiddenCellChanges Complete(Scene* scene) {
  return CompleteHiddenCells(scene->delaunay, &scene->measured, &scene->foam);
}

// A row of cells; the last is opaque and seen, the first is opaque and hidden, and air that no ray
// meets and that no photo has in its picture is between.
Scene Row() {
  Scene scene;
  for (int i = 0; i < 6; ++i) {
    scene.foam.positions.emplace_back(0.1f * i, 0.01f * (i % 2), 0.01f * (i % 3));
    const bool is_air = i > 0 && i < 5;
    scene.foam.raw_density.push_back(static_cast<float>(RawDensity(is_air ? 1e-6 : 500.0)));
    scene.AddMeasurement(i == 0   ? 0.01f
                         : i == 5 ? 50.f
                                  : 0.f,
                         is_air ? 0.f : 1.f,
                         {i == 5 ? 0.75f : 0.25f, 0.5f, 0.5f});
    if (is_air) scene.measured.potential_rays[i] = 0;
    for (int c = 0; c < 3; ++c) scene.foam.sh.push_back(1.f);
  }
  scene.delaunay = Triangulate(WithGuardSites(scene.foam.positions));
  return scene;
}

TEST(HiddenCells, HaveTheMeanColourOfTheirOpaqueNeighbours) {
  const Scene before = RandomScene();
  Scene scene = before;
  const HiddenCellChanges changes = Complete(&scene);
  int64_t hidden = 0;
  for (uint32_t i = 0; i < kNumSites; ++i) {
    if (!before.IsHidden(i)) {
      EXPECT_EQ(scene.MeanColor(i), before.MeanColor(i));
      EXPECT_EQ(scene.ColorAt(i), before.ColorAt(i));
      continue;
    }
    ++hidden;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (const uint32_t j : scene.delaunay.Neighbors(i)) {
      if (j >= kNumSites || scene.IsAir(j)) continue;
      sum += scene.MeanColor(j);
      ++count;
    }
    ASSERT_GT(count, 0);
    EXPECT_LT((scene.MeanColor(i) - sum / count).cwiseAbs().maxCoeff(), 1e-3f) << i;
    EXPECT_LT((scene.ColorAt(i) - scene.MeanColor(i)).cwiseAbs().maxCoeff(), 1e-5f);
    const float* sh = &scene.foam.sh[size_t{i} * scene.foam.ShStride()];
    EXPECT_TRUE(std::all_of(sh + 3, sh + scene.foam.ShStride(), [](float c) { return c == 0; }));
    const float* gradient = &scene.foam.color_gradient[size_t{i} * kColorGradientDim];
    EXPECT_TRUE(
        std::all_of(gradient, gradient + kColorGradientDim, [](float c) { return c == 0; }));
  }
  EXPECT_EQ(changes.recolored, hidden);
  EXPECT_GT(hidden, 100);
  EXPECT_EQ(changes.filled, 0);
  EXPECT_TRUE(scene.foam.assumed_density.empty());
  EXPECT_EQ(scene.foam.raw_density, before.foam.raw_density);
}

TEST(HiddenCells, PassColoursThroughAirOutsideAllPhotos) {
  Scene scene = Row();
  const HiddenCellChanges changes = Complete(&scene);
  EXPECT_EQ(changes.recolored, 1);
  EXPECT_EQ(changes.filled, 0);
  EXPECT_NEAR(scene.MeanColor(0).x(), 0.75f, 1e-4f);
  EXPECT_NEAR(scene.ColorAt(0).x(), 0.75f, 1e-4f);
  EXPECT_EQ(scene.MeanColor(1).x(), 0.25f);
}

TEST(HiddenCells, AreFilledWherePhotosLookAndNoneSeesThem) {
  Scene scene = Row();
  // Photos look at the air, which something hides, and at a cell between the rays that were cast.
  for (const uint32_t i : {1, 2}) scene.measured.potential_rays[i] = 100;
  scene.measured.potential_rays[3] = 0.5f * kFewestPotentialRays;
  const Scene before = scene;
  const HiddenCellChanges changes = Complete(&scene);
  EXPECT_EQ(changes.recolored, 1);
  EXPECT_EQ(changes.filled, 2);
  const std::vector<float> radii = CellRadii(WithGuardSites(scene.foam.positions), scene.delaunay);
  ASSERT_EQ(scene.foam.assumed_density.size(), 6u);
  for (uint32_t i = 0; i < 6; ++i) {
    const bool is_filled = i == 1 || i == 2;
    EXPECT_FLOAT_EQ(scene.foam.assumed_density[i], is_filled ? kFilledOpticalDepth / radii[i] : 0.f)
        << i;
    EXPECT_NEAR(scene.ColorAt(i).x(), is_filled || i == 0 ? 0.75f : before.ColorAt(i).x(), 1e-4f);
  }
  EXPECT_EQ(scene.foam.raw_density, before.foam.raw_density);
  EXPECT_EQ(scene.ColorAt(3), before.ColorAt(3));
  // Views show them as opaque, and what was trained.
  const std::vector<float> shown = CellDensities(scene.foam);
  EXPECT_FLOAT_EQ(shown[1], scene.foam.assumed_density[1]);
  EXPECT_FLOAT_EQ(shown[5], 500.f);
}

// Gives the last cell of a row another identity than the others.
void AddIdentities(Foam* foam) {
  foam->num_classes = 2;
  for (int i = 0; i < 6; ++i) {
    for (int c = 0; c < kIdentityDim; ++c) {
      foam->identity.push_back(c == (i == 5 ? 0 : 1) ? 3.f : 0.f);
    }
  }
}

TEST(HiddenCells, HaveTheIdentitiesOfSeenCells) {
  Scene scene = Row();
  for (const uint32_t i : {1, 2}) scene.measured.potential_rays[i] = 100;
  AddIdentities(&scene.foam);
  const Scene before = scene;
  Complete(&scene);
  for (int i = 0; i < 6; ++i) {
    // Cells 0, 1 and 2 are hidden and opaque or filled.
    const float* const expected = &before.foam.identity[(i < 3 ? 5 : i) * kIdentityDim];
    for (int c = 0; c < kIdentityDim; ++c) {
      EXPECT_NEAR(scene.foam.identity[i * kIdentityDim + c], expected[c], 1e-3f) << i;
    }
  }
}

TEST(HiddenCells, GetIdentitiesAtALargerShareThanColours) {
  Scene scene = Row();
  AddIdentities(&scene.foam);
  scene.measured.weight[0] = 0.5f * (kHiddenShare + kHiddenIdentityShare) * 100;
  const Scene before = scene;
  EXPECT_EQ(Complete(&scene).recolored, 0);
  EXPECT_EQ(scene.foam.sh, before.foam.sh);
  EXPECT_NEAR(scene.foam.identity[0], 3, 1e-3f);
  EXPECT_NEAR(scene.foam.identity[1], 0, 1e-3f);
  // Air outside of all photos keeps its identity.
  EXPECT_EQ(scene.foam.identity[kIdentityDim + 1], 3);

  scene = before;
  scene.measured.weight[0] = 1.1f * kHiddenIdentityShare * 100;
  Complete(&scene);
  EXPECT_EQ(scene.foam.identity, before.foam.identity);
}

TEST(HiddenCells, StayWhereTheyAreSmallerThanTheRaysAreApart) {
  Scene scene = RandomScene();
  for (float& rays : scene.measured.potential_rays) rays = 0.9f * kFewestPotentialRays;
  std::fill(scene.measured.weight.begin(), scene.measured.weight.end(), 0.f);
  scene.measured.weight[1] = 1;
  const Scene before = scene;
  EXPECT_EQ(Complete(&scene).recolored, 0);
  EXPECT_EQ(scene.foam.sh, before.foam.sh);
}

TEST(HiddenCells, StayWhereNoSeenCellIs) {
  Scene scene = RandomScene();
  std::fill(scene.measured.weight.begin(), scene.measured.weight.end(), 0.01f);
  std::fill(scene.measured.transmittance.begin(), scene.measured.transmittance.end(), 0.f);
  const Scene before = scene;
  const HiddenCellChanges changes = Complete(&scene);
  EXPECT_EQ(changes.recolored + changes.filled, 0);
  EXPECT_EQ(scene.measured.statistics.mean_color, before.measured.statistics.mean_color);
  EXPECT_EQ(scene.foam.sh, before.foam.sh);
}

TEST(HiddenCells, WithoutAnyNothingChanges) {
  Scene scene = RandomScene();
  std::fill(scene.measured.weight.begin(), scene.measured.weight.end(), 10.f);
  const HiddenCellChanges changes = Complete(&scene);
  EXPECT_EQ(changes.recolored + changes.filled, 0);
}

TEST(HiddenCells, AreTheSameOnAnyNumberOfThreads) {
  const auto recolored = [](int threads) {
    const ThreadLimit limit(threads);
    Scene scene = RandomScene();
    std::fill(scene.measured.transmittance.begin(), scene.measured.transmittance.end(), 0.f);
    EXPECT_GT(Complete(&scene).filled, 0);
    return std::pair(scene.foam.sh, scene.foam.assumed_density);
  };
  const auto one = recolored(1);
  for (const int threads : {2, 5}) EXPECT_EQ(recolored(threads), one);
}

}  // namespace
}  // namespace semfoam
