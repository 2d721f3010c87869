// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/free_space.h"

#include "foam/random_vectors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Cameras on an arc around the origin, `degrees` apart, that look at it, 1 away. View 1 is held
// out.
class Arc final : public TrainingViews {
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
