// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/plane_fit.h"

#include "foam/util/random.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

double AngleDegrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 / std::numbers::pi;
}

const Eigen::Matrix3d kTilt =
    Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();

// A floor of 4 x 3 at z = 0 with noise, and half as many points above it, all turned and moved.
SurfaceSamples TiltedFloor(double noise, const Eigen::Vector3d& offset) {
  SurfaceSamples samples;
  for (int i = 0; i < 3000; ++i) {
    CounterRandom random(1, 2, i);
    const double x = 4 * random.Uniform() - 2, y = 3 * random.Uniform() - 1.5;
    const double z = i % 3 == 0 ? 2 * random.Uniform() : noise * random.Normal();
    samples.points.emplace_back(kTilt * Eigen::Vector3d(x, y, z) + offset);
    samples.weights.push_back(1);
  }
  samples.tolerance = 3 * noise;
  return samples;
}

TEST(PlaneFit, ANoisyFloorAmongThingsIsFoundToATenthOfADegree) {
  for (const double offset : {0.0, 5e6}) {
    const SurfaceSamples samples = TiltedFloor(0.01, Eigen::Vector3d::Constant(offset));
    const std::optional<PlaneFit> fit = FitPlane(samples);
    ASSERT_TRUE(fit);
    EXPECT_LT(AngleDegrees(fit->normal, kTilt.col(2)), 0.1);
    EXPECT_NEAR(fit->rms, 0.01, 0.002);
    EXPECT_NEAR(fit->share, 0.67, 0.03);
    EXPECT_NEAR(kTilt.col(2).dot(fit->point - Eigen::Vector3d::Constant(offset)), 0, 2e-3);
  }
}

TEST(PlaneFit, JudgesChooseThePlaneAndAllPointsFitIt) {
  SurfaceSamples samples = TiltedFloor(0.01, Eigen::Vector3d::Zero());
  samples.num_judges = 200;
  EXPECT_LT(AngleDegrees(FitPlane(samples)->normal, kTilt.col(2)), 0.1);
  // No plane passes through two alone.
  samples.num_judges = 2;
  EXPECT_FALSE(FitPlane(samples));
}

TEST(PlaneFit, TheSameInputGivesTheSameBits) {
  const SurfaceSamples samples = TiltedFloor(0.01, Eigen::Vector3d::Zero());
  EXPECT_EQ(FitPlane(samples)->normal, FitPlane(samples)->normal);
}

TEST(PlaneFit, WeightsDecideWhatIsLarge) {
  // Many points on a wall, few with the weight of a large floor.
  SurfaceSamples samples;
  samples.tolerance = 0.01;
  for (int i = 0; i < 1100; ++i) {
    CounterRandom random(3, 4, i);
    const double u = random.Uniform(), v = random.Uniform();
    const bool is_floor = i % 11 == 0;
    samples.points.emplace_back(is_floor ? Eigen::Vector3d(u, v, 0) : Eigen::Vector3d(u, 0, v));
    samples.weights.push_back(is_floor ? 30 : 1);
  }
  EXPECT_LT(AngleDegrees(FitPlane(samples)->normal, Eigen::Vector3d::UnitZ()), 0.01);
  for (double& weight : samples.weights) weight = 1;
  EXPECT_LT(AngleDegrees(FitPlane(samples)->normal, Eigen::Vector3d::UnitY()), 0.01);
  const NormalLimit limit{Eigen::Vector3d::UnitZ(), 45};
  EXPECT_LT(AngleDegrees(FitPlane(samples, limit)->normal, Eigen::Vector3d::UnitZ()), 0.01);
}

TEST(PlaneFit, WhatHasNoPlaneGivesNone) {
  SurfaceSamples samples;
  samples.tolerance = 0.1;
  EXPECT_FALSE(FitPlane(samples));
  for (int i = 0; i < 20; ++i) {
    samples.points.emplace_back(i * Eigen::Vector3d(1, 2, 3));
    samples.weights.push_back(1);
  }
  EXPECT_FALSE(FitPlane(samples)) << "a line";
  samples.points.assign(20, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(FitPlane(samples)) << "a point";
  samples.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  samples.weights = {1, 1, 0};
  EXPECT_FALSE(FitPlane(samples)) << "two points with a weight";
  samples.weights = {1, 1, 1};
  EXPECT_TRUE(FitPlane(samples));
  EXPECT_FALSE(FitPlane(samples, NormalLimit{Eigen::Vector3d::UnitX(), 45}));
}

TEST(PlaneFit, ACurvedSurfaceTellsByItsShare) {
  SurfaceSamples samples;
  samples.tolerance = 0.05;
  for (int i = 0; i < 2000; ++i) {
    CounterRandom random(5, 6, i);
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    samples.points.emplace_back(Eigen::Vector3d(x, y, z).normalized());
    samples.weights.push_back(1);
  }
  EXPECT_LT(FitPlane(samples)->share, 0.2);
}

}  // namespace
}  // namespace semfoam
