// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/flat_parts.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/export/surface/surface_checks.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

constexpr double kRadius = 0.05;

// A surface of cells with kRadius, with noise along z or all axes.
struct NoisySurface {
  Triangles triangles;
  std::vector<Vector3d> positions;
  std::vector<uint8_t> shown;
  std::vector<double> radii;
  std::vector<uint8_t> is_fixed;

  NoisySurface(const ObjectSurface& surface, double noise) : triangles(surface.triangles) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> by(-noise, noise);
    for (const Vector3d& x : surface.vertices) {
      const double dx = by(random), dy = by(random), dz = by(random);
      positions.push_back(x + Vector3d(dx, dy, dz));
    }
    shown.assign(positions.size(), 1);
    radii.assign(positions.size(), kRadius);
    is_fixed.assign(positions.size(), 0);
  }

  std::vector<FlatPart> Find() const { return FindFlatParts({triangles, positions, shown, radii}); }
};

// `place` takes two angles in 0 .. 2 pi to a point of a torus-like grid of 48 x 48 squares.
ObjectSurface Wound(const std::function<Vector3d(double, double)>& place) {
  constexpr uint32_t kN = 48;
  ObjectSurface surface;
  for (uint32_t i = 0; i < kN; ++i) {
    for (uint32_t j = 0; j < kN; ++j) {
      surface.vertices.push_back(
          place(2 * std::numbers::pi * i / kN, 2 * std::numbers::pi * j / kN));
      const uint32_t a = i * kN + j, b = (i + 1) % kN * kN + j, c = i * kN + (j + 1) % kN,
                     d = (i + 1) % kN * kN + (j + 1) % kN;
      surface.triangles.push_back({a, b, d});
      surface.triangles.push_back({a, d, c});
    }
  }
  return surface;
}

ObjectSurface Donut() {
  return Wound([](double u, double v) {
    const double r = 1 + 0.35 * std::cos(v);
    return Vector3d(r * std::cos(u), r * std::sin(u), 0.35 * std::sin(v));
  });
}

// The box [-1, 1]^3 bulged to a ball of radius 1.
ObjectSurface Ball() {
  ObjectSurface ball = BoxSurface(24);
  for (Vector3d& x : ball.vertices) x.normalize();
  return ball;
}

TEST(FlatParts, TheSidesOfANoisyBoxBecomePlanesThatMeetInItsEdges) {
  const ObjectSurface box = BoxSurface(24);
  NoisySurface noisy(box, 0.6 * kRadius);
  const std::vector<FlatPart> parts = noisy.Find();
  ASSERT_EQ(parts.size(), 6u);
  for (const FlatPart& part : parts) {
    // Out of the box, at a distance of 1 from its middle.
    EXPECT_NEAR(part.plane.signedDistance(Vector3d::Zero()), -1, 0.1 * kRadius);
    EXPECT_GT(part.plane.normal().cwiseAbs().maxCoeff(), std::cos(0.01));
    EXPECT_NEAR(part.tolerance, 2 * kRadius, 1e-12);
  }
  const std::vector<uint8_t> is_flat =
      Flatten(parts, noisy.triangles, noisy.radii, noisy.is_fixed, &noisy.positions);
  double before = 0, after = 0;
  int num_flat = 0;
  const NoisySurface untouched(box, 0.6 * kRadius);
  for (size_t v = 0; v < noisy.positions.size(); ++v) {
    if (!is_flat[v]) continue;
    ++num_flat;
    before += std::pow(untouched.positions[v].cwiseAbs().maxCoeff() - 1, 2);
    after += std::pow(noisy.positions[v].cwiseAbs().maxCoeff() - 1, 2);
  }
  EXPECT_GT(num_flat, 0.8 * static_cast<double>(noisy.positions.size()));
  EXPECT_LT(after, 0.05 * before);
}

TEST(FlatParts, AVertexOfTwoPlanesMovesIntoTheirLine) {
  // A vertex whose normal is between those of two planes that it is near to.
  const Triangles triangles{{0, 1, 2}};
  std::vector<Vector3d> positions{{0.02, 0.03, 0}, {1.02, -0.97, 1}, {-0.98, 1.03, 1}};
  const Vector3d normal =
      (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalized();
  const Vector3d across = normal.unitOrthogonal();
  const double angle = std::numbers::pi / 9;  // 20 degrees on either side
  const std::vector<FlatPart> parts{
      {{Vector3d(std::cos(angle) * normal + std::sin(angle) * across), Vector3d::Zero()}, 0.2},
      {{Vector3d(std::cos(angle) * normal - std::sin(angle) * across), Vector3d::Zero()}, 0.2}};
  const std::vector<uint8_t> is_flat =
      Flatten(parts, triangles, {0.01, 0.01, 0.01}, {0, 1, 0}, &positions);
  EXPECT_EQ(is_flat[0], 1);
  EXPECT_NEAR(parts[0].plane.signedDistance(positions[0]), 0, 1e-12);
  EXPECT_NEAR(parts[1].plane.signedDistance(positions[0]), 0, 1e-12);
  // Fixed ones stay.
  EXPECT_EQ(positions[1], Vector3d(1.02, -0.97, 1));
}

TEST(FlatParts, WhatIsCurvedHasNone) {
  for (const double noise : {0.0, 0.3 * kRadius}) {
    EXPECT_TRUE(NoisySurface(Ball(), noise).Find().empty()) << noise;
    // The ring on which it lies, and that on its top, are near planes.
    EXPECT_TRUE(NoisySurface(Donut(), noise).Find().empty()) << noise;
  }
}

TEST(FlatParts, WhatNoPhotoShowsAndWhatIsSmallHasNone) {
  NoisySurface box(BoxSurface(24), 0.3 * kRadius);
  box.shown.assign(box.shown.size(), 0);
  EXPECT_TRUE(box.Find().empty());
  EXPECT_TRUE(NoisySurface(BoxSurface(2), 0).Find().empty());
  EXPECT_TRUE(FindFlatParts({{}, {}, {}, {}}).empty());
  // One side is shown: its plane alone.
  NoisySurface top(BoxSurface(24), 0.3 * kRadius);
  for (size_t v = 0; v < top.shown.size(); ++v) top.shown[v] = top.positions[v].z() > 0.97;
  const std::vector<FlatPart> parts = top.Find();
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_NEAR(parts[0].plane.normal().z(), 1, 1e-3);
}

TEST(FlatParts, LargeCellsMayBeFartherFromAPlane) {
  const std::vector<FlatPart> parts{{{Vector3d(0, 0, 1), Vector3d::Zero()}, 0.1}};
  const Triangles triangles{{0, 1, 2}};
  const std::vector<Vector3d> far{{0, 0, 0.3}, {1, 0, 0.3}, {0, 1, 0.3}};
  std::vector<Vector3d> positions = far;
  EXPECT_EQ(Flatten(parts, triangles, {0.05, 0.05, 0.05}, {0, 0, 0}, &positions)[0], 0);
  EXPECT_EQ(positions, far);
  EXPECT_EQ(Flatten(parts, triangles, {0.5, 0.5, 0.5}, {0, 0, 0}, &positions)[0], 1);
  for (const Vector3d& x : positions) EXPECT_EQ(x.z(), 0);
  // A back has the opposite normal, and stays.
  const Triangles turned{{0, 2, 1}};
  positions = far;
  EXPECT_EQ(Flatten(parts, turned, {0.5, 0.5, 0.5}, {0, 0, 0}, &positions)[0], 0);
  EXPECT_EQ(positions, far);
}

}  // namespace
}  // namespace semfoam
