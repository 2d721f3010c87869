// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/hanging_cells.h"

#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr float kWallDistance = 2;
constexpr float kGrey = 0.6f;

// Photos of a plain wall: some from near, the others from afar.
class WallViews final : public TrainingViews {
 public:
  int NumViews() const override { return 10; }
  int Width(int) const override { return 80; }
  int Height(int) const override { return 60; }
  bool IsHeldOut(int view) const override { return held_out(view); }
  Eigen::Vector3d Origin(int view) const override {
    if (view < num_near) return {0.2 + 0.02 * view, 0, 0};
    return {0.3 * view - 1.3, 0, -3};
  }
  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    const float focal_length = view < num_near ? 60 : 180;
    ray->direction = Eigen::Vector3f(x + 0.5f - 40, y + 0.5f - 30, focal_length).normalized();
    ray->color.setConstant(kGrey);
    return true;
  }

  std::function<bool(int view)> held_out = [](int) { return false; };
  int num_near = 1;
};

// A wall of small cells with air before it, in which one large opaque cell hangs.
struct Scene {
  explicit Scene(float wall_density = 1e4f) {
    AddLayer(kWallDistance, wall_density);
    AddLayer(kWallDistance + 0.06f, wall_density);
    AddLayer(kWallDistance - 0.06f, 0);
    const Eigen::Vector3f place(0.2f, 0, 0.9f);
    for (int i = 0; i < 1500; ++i) {
      CounterRandom random(3, 0x51, i);
      const double x = random.Uniform(), y = random.Uniform(), z = random.Uniform();
      const Eigen::Vector3f site(4 * x - 2, 3 * y - 1.5, 2.2 * z - 0.5);
      if ((site - place).norm() > 0.25f) Add(site, 0);
    }
    hanging = static_cast<uint32_t>(foam.NumSites());
    Add(place, 1e4f);
  }

  void Add(const Eigen::Vector3f& site, float density) {
    foam.positions.push_back(site);
    foam.raw_density.push_back(density > 0 ? static_cast<float>(RawDensity(density)) : -2.f);
    foam.sh.insert(foam.sh.end(), 3, (kGrey - 0.5f) / static_cast<float>(kShDc));
  }

  void AddLayer(float z, float density) {
    for (int i = 0; i < 60; ++i) {
      for (int k = 0; k < 40; ++k) {
        CounterRandom random(5, i, k);
        const double x = i + 0.3 * random.Uniform(), y = k + 0.3 * random.Uniform();
        Add(Eigen::Vector3f(0.08 * (x - 30), 0.08 * (y - 20), z), density);
      }
    }
  }

  void SetColor(uint32_t cell, float value) {
    std::fill_n(&foam.sh[3 * cell], 3, (value - 0.5f) / static_cast<float>(kShDc));
  }

  std::vector<uint32_t> Find(const TrainingViews& views) const {
    TrainingTopology topology;
    topology.Triangulate(foam.positions, FreeSpace(), /*with_areas=*/false);
    return FindHangingCells(foam, topology, views);
  }

  Foam foam;
  uint32_t hanging = 0;
};

TEST(HangingCells, OfTheWallsColourIsFound) {
  const Scene scene;
  EXPECT_EQ(scene.Find(WallViews()), std::vector<uint32_t>{scene.hanging});
}

TEST(HangingCells, OfAnotherColourStays) {
  Scene scene;
  scene.SetColor(scene.hanging, kGrey - 0.13f);
  EXPECT_TRUE(scene.Find(WallViews()).empty());
  scene.SetColor(scene.hanging, kGrey - 0.11f);
  EXPECT_EQ(scene.Find(WallViews()), std::vector<uint32_t>{scene.hanging});
}

// What is behind it is as white as the cell, but nothing.
TEST(HangingCells, BeforeNothingStays) {
  Scene scene(/*wall_density=*/0);
  scene.SetColor(scene.hanging, 1);
  EXPECT_TRUE(scene.Find(WallViews()).empty());
}

// What hardly any photo shows behind the cell may be made up.
TEST(HangingCells, BeforeWhatFewPhotosShowStays) {
  const Scene scene;
  WallViews views;
  views.held_out = [](int view) { return view != 0 && view != 3 && view != 7; };
  EXPECT_TRUE(scene.Find(views).empty());
}

// Of the colour of what is behind it, but there.
TEST(HangingCells, ThatThreePhotosShowFromNearStays) {
  const Scene scene;
  WallViews views;
  views.num_near = kFewestWitnesses - 1;
  EXPECT_EQ(scene.Find(views), std::vector<uint32_t>{scene.hanging});
  ++views.num_near;
  EXPECT_TRUE(scene.Find(views).empty());
}

TEST(HangingCells, ThatIsHeldOutIsNotLookedAt) {
  const Scene scene;
  WallViews views;
  views.held_out = [](int view) { return view == 0; };
  EXPECT_TRUE(scene.Find(views).empty());
}

// A large cell in a window of the wall, before another wall: not nearer than what photos show.
TEST(HangingCells, AtTheDistanceOfTheRestStays) {
  const Scene wall;
  const Eigen::Vector3f place(0, 0, kWallDistance);
  Scene scene = wall;
  scene.foam = {};
  for (uint32_t i = 0; i < wall.foam.NumSites(); ++i) {
    const Eigen::Vector3f& site = wall.foam.positions[i];
    if (i == wall.hanging || (site - place).norm() < 0.5f) continue;
    scene.Add(site, Density(wall.foam.raw_density[i]) > 1 ? 1e4f : 0);
  }
  scene.Add(place, 1e4f);
  for (int i = 0; i < 8; ++i) {
    const double angle = i * std::numbers::pi / 4;
    scene.Add(place + Eigen::Vector3f(0.35 * std::cos(angle), 0.35 * std::sin(angle), 0), 0);
  }
  for (int i = 0; i < 40 * 40; ++i) {
    const Eigen::Vector3f site(0.1f * (i % 40 - 20), 0.1f * (i / 40 - 20), kWallDistance + 0.8f);
    scene.Add(site, 1e4f);
    scene.Add(site - Eigen::Vector3f(0, 0, 0.1f), 0);
  }
  EXPECT_EQ(scene.Find(WallViews()), std::vector<uint32_t>{});
}

TEST(HangingCells, AreTheSameOnAnyNumberOfThreads) {
  const Scene scene;
  const WallViews views;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(scene.Find(views), std::vector<uint32_t>{scene.hanging}) << threads;
  }
}

}  // namespace
}  // namespace semfoam
