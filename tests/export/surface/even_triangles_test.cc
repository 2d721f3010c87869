// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/even_triangles.h"

#include "export/surface/surface_geometry.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/export/surface/surface_checks.h"
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// In degrees, of each triangle.
std::vector<double> SmallestAngles(const ObjectSurface& surface) {
  std::vector<double> angles;
  for (const auto& triangle : surface.triangles) {
    double smallest = 180;
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = surface.vertices[triangle[k]];
      const Vector3d to_b = surface.vertices[triangle[(k + 1) % 3]] - a;
      const Vector3d to_c = surface.vertices[triangle[(k + 2) % 3]] - a;
      smallest =
          std::min(smallest, std::atan2(to_b.cross(to_c).norm(), to_b.dot(to_c)) * 180 / M_PI);
    }
    angles.push_back(smallest);
  }
  return angles;
}

// A box whose vertices are off their places, on its sides along these.
ObjectSurface UnevenBox(int n, unsigned seed) {
  ObjectSurface box = BoxSurface(n);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> move(-0.5 / n, 0.5 / n);
  for (Vector3d& x : box.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      const double by = move(random);
      if (std::abs(x[axis]) < 1) x[axis] += by;
    }
  }
  return box;
}

ObjectSurface Even(const ObjectSurface& surface) {
  ObjectSurface even = surface;
  even.triangles = EvenTriangles(
      surface.triangles, surface.vertices, std::vector<uint8_t>(surface.vertices.size(), 0));
  return even;
}

TEST(EvenTriangles, SmallAnglesGrowAndTheSurfaceStays) {
  for (const unsigned seed : {1, 2, 3}) {
    const ObjectSurface box = UnevenBox(12, seed);
    ASSERT_TRUE(SelfIntersections(box.vertices, box.triangles).empty());
    const ObjectSurface even = Even(box);
    ASSERT_EQ(even.triangles.size(), box.triangles.size());
    ExpectClosedManifold(even);
    EXPECT_EQ(EulerCharacteristic(even), 2);
    EXPECT_TRUE(SelfIntersections(even.vertices, even.triangles).empty());
    // Its sides are flat, so no flip moves them.
    EXPECT_NEAR(EnclosedVolume(even), 8, 1e-12);
    const std::vector<double> before = SmallestAngles(box), after = SmallestAngles(even);
    const auto count = [](const std::vector<double>& angles) {
      return std::count_if(angles.begin(), angles.end(), [](double x) { return x < 30; });
    };
    EXPECT_GT(count(before), 100);
    EXPECT_LT(count(after), 0.6 * static_cast<double>(count(before)));
  }
}

TEST(EvenTriangles, EvenOnesAndEdgesStay) {
  const ObjectSurface box = BoxSurface(4);
  EXPECT_EQ(Even(box).triangles, box.triangles);
  ObjectSurface none;
  EXPECT_TRUE(Even(none).triangles.empty());
}

TEST(EvenTriangles, NoEdgeBesideAFixedVertexIsFlipped) {
  const ObjectSurface box = UnevenBox(12, 4);
  std::vector<uint8_t> is_fixed(box.vertices.size(), 0);
  for (size_t v = 0; v < is_fixed.size(); ++v) is_fixed[v] = box.vertices[v].x() > 0;
  const auto fixed = [&](const Triangles& triangles) {
    Triangles those;
    for (const auto& t : triangles) {
      if (is_fixed[t[0]] || is_fixed[t[1]] || is_fixed[t[2]]) those.push_back(t);
    }
    return those;
  };
  const Triangles even = EvenTriangles(box.triangles, box.vertices, is_fixed);
  EXPECT_EQ(fixed(even), fixed(box.triangles));
  EXPECT_NE(even, box.triangles);
}

TEST(EvenTriangles, TrianglesWithoutAreaDoNoHarm) {
  ObjectSurface box = UnevenBox(8, 5);
  for (size_t f = 0; f < box.triangles.size(); f += 7) {
    box.vertices[box.triangles[f][0]] = box.vertices[box.triangles[f][1]];
  }
  ExpectClosedManifold(Even(box));
}

}  // namespace
}  // namespace semfoam
