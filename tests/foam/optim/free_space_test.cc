// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/free_space.h"

#include "foam/geometry/guard_sites.h"
#include "foam/optim/training_topology.h"
#include "foam/util/random_vectors.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Cameras on an arc around the origin, `degrees` apart, that look at it, 1 away. View 1 is held
// out.
class Arc : public TrainingViews {
 public:
  Arc(int num_views, double degrees) : num_views_(num_views), degrees_(degrees) {}

  int NumViews() const override { return num_views_; }
  int Width(int) const override { return 64; }
  int Height(int) const override { return 64; }
  bool IsHeldOut(int view) const override { return view == 1; }
  Eigen::Vector3d Origin(int view) const override { return At(view); }

  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    const Eigen::Vector3d forward = -At(view);
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d down = forward.cross(right);
    ray->direction = (forward + ((x + 0.5) / 64 - 0.5) * right + ((y + 0.5) / 64 - 0.5) * down)
                         .normalized()
                         .cast<float>();
    return true;
  }

  // Where view number `view` stands, or would stand if it is no whole number.
  Eigen::Vector3d At(double view) const {
    const double angle = view * degrees_ * M_PI / 180;
    return {std::cos(angle), std::sin(angle), 0};
  }

 private:
  int num_views_;
  double degrees_;
};

// A cloud of points around the origin.
std::vector<SeedPoint> Ball(double radius, int count) {
  std::vector<SeedPoint> seeds;
  for (int i = 0; i < count; ++i) {
    CounterRandom random(7, 1, i);
    seeds.push_back(
        {(radius * NormalVector(&random).normalized()).cast<float>(), Eigen::Vector3f::Ones()});
  }
  return seeds;
}

// Cameras in a square grid, `spacing` apart, that look the same way, as from the air.
class Survey final : public TrainingViews {
 public:
  Survey(int side, double spacing) : side_(side), spacing_(spacing) {}

  int NumViews() const override { return side_ * side_; }
  int Width(int) const override { return 64; }
  int Height(int) const override { return 64; }
  bool IsHeldOut(int) const override { return false; }
  Eigen::Vector3d Origin(int view) const override {
    return {spacing_ * (view % side_), spacing_ * static_cast<double>(view / side_), 0};
  }
  bool Ray(int, int x, int y, TrainingRay* ray) const override {
    ray->direction =
        Eigen::Vector3f((x + 0.5f) / 64 - 0.5f, (y + 0.5f) / 64 - 0.5f, 1).normalized();
    return true;
  }

  // Points of the ground below, 1 away, give or take a tenth.
  std::vector<SeedPoint> GroundPoints(int count) const {
    std::vector<SeedPoint> seeds;
    for (int i = 0; i < count; ++i) {
      CounterRandom random(7, 2, i);
      const Eigen::Vector3d unit = UniformVector(&random);
      const double extent = spacing_ * side_;
      seeds.push_back({Eigen::Vector3d(extent * unit.x(), extent * unit.y(), 0.9 + 0.2 * unit.z())
                           .cast<float>(),
                       Eigen::Vector3f::Ones()});
    }
    return seeds;
  }

 private:
  int side_;
  double spacing_;
};

// The radius of a photo's cone, found by looking at every seed.
float RadiusOfAllSeeds(const ClearCone& cone, const std::vector<SeedPoint>& seeds) {
  std::vector<float> distances;
  for (const SeedPoint& seed : seeds) {
    const Eigen::Vector3f offset = seed.position - cone.apex;
    const float distance = offset.norm();
    if (offset.dot(cone.axis) > cone.cosine * distance) distances.push_back(distance);
  }
  std::sort(distances.begin(), distances.end());
  const float nearest = distances[distances.size() / 50];
  const float median = distances[distances.size() / 2];
  return std::clamp(nearest - 0.5f * (median - nearest), 0.3f * nearest, 0.95f * nearest);
}

// What the header promises of the work.
int64_t MostTests(const FreeSpace& space, int num_views) {
  constexpr int64_t kBlocks = 4096;
  const auto cones = static_cast<int64_t>(space.cones().size());
  return 2 * FreeSpace::kMostSeedTests +
         (num_views + cones) * (kBlocks + FreeSpace::kFewestSampledSeeds);
}

// At `part` of the way from where view number `view` stands to the origin.
Eigen::Vector3f Before(const Arc& arc, double view, double part) {
  return ((1 - part) * arc.At(view)).cast<float>();
}

TEST(FreeSpace, ReachesNearlyToPointsInANarrowBand) {
  const Arc arc(1, 0);
  const FreeSpace space(arc, Ball(0.05, 1000));
  ASSERT_EQ(space.cones().size(), 1);
  // The points lie from 0.95 to 1.05: the nearest at about 0.95, the median at 1.
  EXPECT_NEAR(space.cones()[0].radius, 0.95 * 0.95, 0.01);
  EXPECT_TRUE(space.Contains(Before(arc, 0, 0.88)));
  EXPECT_FALSE(space.Contains(Before(arc, 0, 0.92)));
}

// A plane 0.2 below the cameras, up to `radius` from the origin.
class ArcAboveGround final : public Arc {
 public:
  explicit ArcAboveGround(float radius) : Arc(1, 0), radius_(radius) {}
  std::optional<SolidGround> Ground() const override {
    return SolidGround{.level = -0.2f, .radius = radius_, .thickness = 0.02f};
  }

 private:
  float radius_;
};

TEST(FreeSpace, IsNotInTheGround) {
  const std::vector<SeedPoint> seeds = Ball(0.05, 1000);
  const Eigen::Vector3f on(0.4f, 0, -0.19f), below(0.4f, 0, -0.25f), above(0.4f, 0, -0.17f);
  for (const Eigen::Vector3f& x : {on, below, above}) {
    EXPECT_TRUE(FreeSpace(Arc(1, 0), seeds).Contains(x));
    EXPECT_TRUE(FreeSpace(ArcAboveGround(0.3f), seeds).Contains(x));
  }
  const FreeSpace space(ArcAboveGround(0.5f), seeds);
  EXPECT_FALSE(space.Contains(on));
  EXPECT_FALSE(space.Contains(below));
  EXPECT_TRUE(space.Contains(above));
}

TEST(FreeSpace, StaysFarFromScatteredPoints) {
  const Arc arc(1, 0);
  const FreeSpace space(arc, Ball(0.4, 1000));
  ASSERT_EQ(space.cones().size(), 1);
  // From 0.6 to 1.4: things without a point may be nearer than the nearest point.
  EXPECT_GT(space.cones()[0].radius, 0.3 * 0.6);
  EXPECT_LT(space.cones()[0].radius, 0.75 * 0.65);
}

TEST(FreeSpace, IsKnownBetweenTheCamerasToo) {
  const Arc arc(3, 20);  // the middle one is held out
  const FreeSpace space(arc, Ball(0.05, 1000));
  for (const double part : {0.1, 0.5, 0.8}) {
    EXPECT_TRUE(space.Contains(Before(arc, 0, part)));
    EXPECT_TRUE(space.Contains(Before(arc, 1, part))) << part;
    EXPECT_TRUE(space.Contains(Before(arc, 2, part)));
    EXPECT_FALSE(space.Contains(Before(arc, 12, part))) << "nobody is there";
  }
}

// A site beside the view, whose cell reaches before the camera where it is large.
TEST(FreeSpace, KeepsLargeCellsClearWhoseBodiesReachIntoIt) {
  const Arc arc(1, 0);
  const FreeSpace space(arc, Ball(0.05, 1000));
  const Eigen::Vector3f beside(0.75f, 0.5f, 0);
  ASSERT_FALSE(space.Contains(beside));
  const std::vector<Eigen::Vector3f> around = {{0.8f, -0.9f, 0},
                                               {0.3f, 0, 0.9f},
                                               {0.3f, 0, -0.9f},
                                               {-0.5f, 0.3f, 0},
                                               {1.5f, 0.5f, 0},
                                               {0.8f, 1.2f, 0}};
  for (const float size : {1.f, 0.1f}) {
    std::vector<Eigen::Vector3f> sites = {beside};
    for (const Eigen::Vector3f& site : around) sites.push_back(beside + size * (site - beside));
    TrainingTopology topology;
    topology.Triangulate(sites, space, /*with_areas=*/false);
    EXPECT_EQ(topology.is_clear()[0], size == 1) << size;
    topology.Triangulate(sites, FreeSpace(), /*with_areas=*/false);
    EXPECT_EQ(topology.is_clear()[0], 0);
  }
}

TEST(FreeSpace, IsNotKnownBetweenCamerasFarApart) {
  const Arc arc(3, 70);
  const FreeSpace space(arc, Ball(0.05, 1000));
  EXPECT_EQ(space.cones().size(), 2);
  EXPECT_FALSE(space.Contains(Before(arc, 1, 0.2)));
}

TEST(FreeSpace, NeedsPoints) {
  const Arc arc(3, 20);
  const FreeSpace space(arc, Ball(0.05, 49));
  EXPECT_TRUE(space.cones().empty());
  EXPECT_FALSE(space.Contains(Before(arc, 0, 0.1)));
  EXPECT_FALSE(FreeSpace().Contains(Eigen::Vector3f::Zero()));
}

TEST(FreeSpace, LiesBetweenTheSurfacesAndSky) {
  const Arc arc(1, 0);
  const std::vector<SeedPoint> surfaces = Ball(0.05, 1000);
  std::vector<SeedPoint> seeds = surfaces;
  const Eigen::Vector3f sky(0, 0, kSkyRadius);
  seeds.push_back({sky, Eigen::Vector3f::Ones()});
  const FreeSpace space(arc, seeds);
  // The camera is 1 away, the surfaces 0.05: what lies around them may have no seeds.
  EXPECT_NEAR(space.sky_begin(), 3, 1e-5);
  EXPECT_FALSE(space.Contains({0, 0, 2.9f}));
  EXPECT_TRUE(space.Contains({0, 0, 3.1f}));
  std::vector<SeedPoint> far_surfaces = Ball(4, 1000);
  far_surfaces.push_back(seeds.back());
  EXPECT_NEAR(FreeSpace(arc, far_surfaces).sky_begin(), 1.2 * 4, 1e-3);
  // Sky does not count as a surface before which the view is clear.
  EXPECT_EQ(space.cones()[0].radius, FreeSpace(arc, surfaces).cones()[0].radius);
  EXPECT_FALSE(FreeSpace(arc, surfaces).Contains({0, 0, 20}));
  TrainingTopology topology;
  const std::vector<Eigen::Vector3f> sites = {
      sky, {0, 0, 20}, {0.01f, 0, 0}, {0, 0.01f, 0}, {-0.01f, 0, 0}, {0, 0, -0.01f}};
  topology.Triangulate(sites, space, /*with_areas=*/false);
  EXPECT_EQ(topology.is_clear()[0], 0);
  EXPECT_EQ(topology.is_clear()[1], 1);
}

TEST(FreeSpace, LooksAtEverySeedWhereTheyAreFew) {
  const SyntheticViews room(24, 32, 24);
  for (const int count : {60, 500, 30'000}) {
    const std::vector<SeedPoint> seeds = room.Seeds(count);
    const FreeSpace space(room, seeds);
    for (size_t i = 0; i < std::min<size_t>(20, space.cones().size()); ++i) {
      EXPECT_EQ(space.cones()[i].radius, RadiusOfAllSeeds(space.cones()[i], seeds)) << i;
    }
    EXPECT_LE(space.num_seed_tests(), MostTests(space, 24));
  }
}

TEST(FreeSpace, LooksAtASampleWhereConesAndSeedsAreMany) {
  constexpr int kViews = 2000, kSeeds = 300'000;
  const Arc arc(kViews, 360.0 / kViews);
  const std::vector<SeedPoint> seeds = Ball(0.4, kSeeds);
  const FreeSpace space(arc, seeds);
  ASSERT_GE(space.cones().size(), kViews - 1u);
  EXPECT_LE(space.num_seed_tests(), MostTests(space, kViews));
  EXPECT_LT(space.num_seed_tests(), int64_t{kViews} * kSeeds / 2);
  for (size_t i = 0; i < kViews - 1; i += 97) {
    const float exact = RadiusOfAllSeeds(space.cones()[i], seeds);
    EXPECT_NEAR(space.cones()[i].radius, exact, 0.01 * exact) << i;
  }
}

// Each photo sees some 400 of the seeds: an even sample of all would leave too few of them.
TEST(FreeSpace, IsKnownToPhotosThatSeeASmallPartOfTheScene) {
  constexpr int kSide = 64, kViews = kSide * kSide, kSeeds = 200'000;
  const Survey survey(kSide, 0.35);
  const std::vector<SeedPoint> seeds = survey.GroundPoints(kSeeds);
  const FreeSpace space(survey, seeds);
  EXPECT_LE(space.num_seed_tests(), MostTests(space, kViews));
  EXPECT_GT(space.cones().size(), kViews + FreeSpace::kMostConesBetween / 2);
  EXPECT_LE(space.cones().size(), kViews + FreeSpace::kMostConesBetween);
  for (size_t i = 0; i < kViews; i += 997) {
    const float exact = RadiusOfAllSeeds(space.cones()[i], seeds);
    EXPECT_NEAR(space.cones()[i].radius, exact, 0.01 * exact) << i;
  }
  for (int view = 0; view < kViews; view += 101) {
    const Eigen::Vector3f origin = survey.Origin(view).cast<float>();
    EXPECT_TRUE(space.Contains(origin + Eigen::Vector3f(0.05f, 0.05f, 0.5f))) << view;
    EXPECT_FALSE(space.Contains(origin + Eigen::Vector3f(0.05f, 0.05f, 1))) << view;
  }
}

// The grid only saves time.
TEST(FreeSpace, IsTheUnionOfItsCones) {
  const SyntheticViews room(24, 32, 24);
  for (const FreeSpace& space :
       {FreeSpace(room, room.Seeds(2000)), FreeSpace(Arc(12, 15), Ball(0.2, 1000))}) {
    ASSERT_GT(space.cones().size(), 12);
    int inside = 0;
    for (int i = 0; i < 20000; ++i) {
      CounterRandom random(3, 2, i);
      const Eigen::Vector3f x = (4 * UniformVector(&random).array() - 2).matrix().cast<float>();
      const bool expected = std::any_of(space.cones().begin(),
                                        space.cones().end(),
                                        [&](const ClearCone& cone) { return cone.Contains(x); });
      ASSERT_EQ(space.Contains(x), expected) << x.transpose();
      inside += expected;
    }
    EXPECT_GT(inside, 200);
    EXPECT_LT(inside, 19000);
  }
  const FreeSpace space(room, room.Seeds(2000));
  EXPECT_FALSE(space.Contains(Eigen::Vector3f::Constant(NAN)));
}

}  // namespace
}  // namespace semfoam
