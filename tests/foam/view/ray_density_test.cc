// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/ray_density.h"

#include "foam/util/random.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

Eigen::Vector3f RandomDirection(int i) {
  CounterRandom random(3, 1, i);
  const double z = 2 * random.Uniform() - 1, angle = 2 * std::numbers::pi * random.Uniform();
  const double r = std::sqrt(1 - z * z);
  return Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z).cast<float>();
}

TEST(RayDensity, IsTheSameInAllDirectionsForRaysInAllDirections) {
  constexpr int kRays = 2'000'000;
  RayDensity density;
  for (int i = 0; i < kRays; ++i) density.Add(RandomDirection(i));
  // Some 330 rays are in a texel.
  const double expected = kRays / (4 * std::numbers::pi);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_NEAR(density.At(RandomDirection(kRays + i)), expected, 0.3 * expected);
  }
}

TEST(RayDensity, IsZeroOutsideTheView) {
  RayDensity density;
  for (int y = -200; y <= 200; ++y) {
    for (int x = -200; x <= 200; ++x) density.Add({0.002f * x, 0.002f * y, -1});
  }
  // A pinhole's rays are 0.002 apart on the plane at distance 1.
  EXPECT_NEAR(density.At({0, 0, -3}), 250'000, 25'000);
  EXPECT_NEAR(density.At({0.3f, -0.2f, -1}), 250'000 * std::pow(1.13, 1.5), 35'000);
  EXPECT_EQ(density.At({0, 0, 1}), 0);
  EXPECT_EQ(density.At({0.6f, 0, -1}), 0);
  EXPECT_EQ(density.At({1, 1, 1}), 0);
  density.Clear();
  EXPECT_EQ(density.At({0, 0, -3}), 0);
}

}  // namespace
}  // namespace semfoam
