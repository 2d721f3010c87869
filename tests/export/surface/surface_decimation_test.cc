// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_decimation.h"

#include "export/surface/surface_geometry.h"

#include <cmath>
#include <random>

#include "tests/export/surface/surface_checks.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// A ball of radius 1.
ObjectSurface Ball(int n) {
  ObjectSurface ball = BoxSurface(n);
  for (Vector3d& x : ball.vertices) x.normalize();
  return ball;
}

TEST(SurfaceDecimation, TheTargetIsMetAndTheSurfaceStaysClosed) {
  const ObjectSurface ball = Ball(20);
  const double volume = EnclosedVolume(ball);
  for (const int64_t target : {3001, 1000, 200, 50}) {
    const ObjectSurface small = Decimate(ball, target);
    EXPECT_LE(static_cast<int64_t>(small.triangles.size()), target);
    // Collapses take two faces at a time.
    EXPECT_GE(static_cast<int64_t>(small.triangles.size()), target - 1);
    ExpectClosedManifold(small);
    EXPECT_EQ(EulerCharacteristic(small), 2);
    EXPECT_LT(EnclosedVolume(small), volume);
    EXPECT_GT(EnclosedVolume(small), (1 - 20.0 / static_cast<double>(target)) * volume);
  }
}

TEST(SurfaceDecimation, FlatFacesCostNothing) {
  const ObjectSurface box = Decimate(BoxSurface(10), 12);
  ASSERT_EQ(box.triangles.size(), 12u);
  ASSERT_EQ(box.vertices.size(), 8u);
  for (const Vector3d& x : box.vertices) EXPECT_EQ(x.cwiseAbs(), Vector3d::Ones());
  EXPECT_NEAR(EnclosedVolume(box), 8, 1e-12);
}

TEST(SurfaceDecimation, WhatStaysKeepsItsColourAndConfidence) {
  const ObjectSurface ball = Ball(12);
  const ObjectSurface small = Decimate(ball, 300);
  EXPECT_EQ(small.object_id, ball.object_id);
  EXPECT_EQ(small.object_name, ball.object_name);
  ASSERT_EQ(small.vertex_color.size(), small.vertices.size());
  ASSERT_EQ(small.vertex_confidence.size(), small.vertices.size());
  size_t from = 0;
  for (size_t v = 0; v < small.vertices.size(); ++v) {
    // In the order of before.
    while (from < ball.vertices.size() && ball.vertices[from] != small.vertices[v]) ++from;
    ASSERT_LT(from, ball.vertices.size());
    EXPECT_EQ(small.vertex_color[v], ball.vertex_color[from]);
    EXPECT_EQ(small.vertex_confidence[v], ball.vertex_confidence[from]);
  }
  ASSERT_EQ(small.face_color.size(), small.triangles.size());
  for (size_t f = 0; f < small.triangles.size(); ++f) {
    float confidence = 0;
    double red = 0;
    for (const uint32_t v : small.triangles[f]) {
      confidence += small.vertex_confidence[v] / 3;
      red += small.vertex_color[v][0] / 3.0;
    }
    EXPECT_NEAR(small.face_confidence[f], confidence, 1e-6);
    EXPECT_NEAR(small.face_color[f][0], red, 0.51);
  }
}

TEST(SurfaceDecimation, ASmallerSurfaceIsLeftAlone) {
  const ObjectSurface box = BoxSurface(2);
  const ObjectSurface same = Decimate(box, 48);
  EXPECT_EQ(same.vertices, box.vertices);
  EXPECT_EQ(same.triangles, box.triangles);
}

TEST(SurfaceDecimation, ItEndsWhereFewerWouldTearOrFold) {
  // Two balls cannot have fewer faces than two tetrahedra.
  ObjectSurface two = Ball(6);
  const uint32_t first = static_cast<uint32_t>(two.vertices.size());
  const ObjectSurface one = two;
  for (size_t v = 0; v < one.vertices.size(); ++v) {
    two.vertices.push_back(one.vertices[v] + Vector3d(3, 0, 0));
    two.vertex_color.push_back(one.vertex_color[v]);
    two.vertex_confidence.push_back(one.vertex_confidence[v]);
  }
  for (const auto& [a, b, c] : one.triangles) {
    two.triangles.push_back({first + a, first + b, first + c});
  }
  ShowVerticesOnFaces(&two);
  const ObjectSurface least = Decimate(two, 4);
  EXPECT_GE(least.triangles.size(), 8u);
  EXPECT_LT(least.triangles.size(), 100u);
  ExpectClosedManifold(least);
  EXPECT_EQ(EulerCharacteristic(least), 4);
  EXPECT_GT(EnclosedVolume(least), 0);
}

TEST(SurfaceDecimation, FacesAreNotFoldedOver) {
  // Where faces lie in one plane no collapse has an error, whatever it turns over.
  ObjectSurface box = BoxSurface(12);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> move(-0.07, 0.07);
  for (Vector3d& x : box.vertices) {
    for (double& coordinate : x) {
      const double by = move(random);
      if (std::abs(coordinate) < 1) coordinate += by;
    }
  }
  const ObjectSurface small = Decimate(box, 200);
  ASSERT_LE(small.triangles.size(), 200u);
  for (const auto& [a, b, c] : small.triangles) {
    const Vector3d& x = small.vertices[a];
    const Vector3d area = (small.vertices[b] - x).cross(small.vertices[c] - x);
    EXPECT_GT(area.dot(x + small.vertices[b] + small.vertices[c]), 0);
  }
}

TEST(SurfaceDecimation, AFarOffsetChangesNothing) {
  const ObjectSurface ball = Ball(10);
  ObjectSurface far = ball;
  // Exact in binary, so that the differences between vertices stay as they are.
  for (Vector3d& x : far.vertices) x = (x * 1024).array().round() / 1024;
  const ObjectSurface near = far;
  for (Vector3d& x : far.vertices) x += Vector3d(524288, 4194304, 256);
  EXPECT_EQ(Decimate(far, 150).triangles, Decimate(near, 150).triangles);
}

}  // namespace
}  // namespace semfoam
