// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_smoothing.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/export/surface/surface_checks.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

constexpr int kSquares = 24;
constexpr double kNoise = 0.3 * 2 / kSquares;

// A box whose vertices are off by up to kNoise in every coordinate.
ObjectSurface NoisyBox() {
  ObjectSurface box = BoxSurface(kSquares);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-kNoise, kNoise);
  for (Vector3d& x : box.vertices) {
    const double dx = noise(random), dy = noise(random), dz = noise(random);
    x += Vector3d(dx, dy, dz);
  }
  return box;
}

// How far a point is from the surface of [-1, 1]^3.
double DistanceToBox(const Vector3d& x) {
  const Vector3d out = (x.cwiseAbs() - Vector3d::Ones()).cwiseMax(0);
  return out.norm() > 0 ? out.norm() : 1 - x.cwiseAbs().maxCoeff();
}

// Root mean square over the vertices that began within `rim` of an edge of the box, or over the
// others.
double Error(const std::vector<Vector3d>& x, bool at_edges) {
  const std::vector<Vector3d> exact = BoxSurface(kSquares).vertices;
  double sum = 0;
  int count = 0;
  for (size_t v = 0; v < x.size(); ++v) {
    Vector3d a = exact[v].cwiseAbs();
    std::sort(a.begin(), a.end());
    if ((a[1] > 1 - 3.0 / kSquares) != at_edges) continue;
    sum += std::pow(DistanceToBox(x[v]), 2);
    ++count;
  }
  EXPECT_GT(count, 100);
  return std::sqrt(sum / count);
}

TEST(SurfaceSmoothing, EnclosedVolumeIsExactAndSigned) {
  ObjectSurface box = BoxSurface(3);
  EXPECT_NEAR(EnclosedVolume(box.vertices, box.triangles), 8, 1e-12);
  for (Vector3d& x : box.vertices) x += Vector3d(5e5, 4.5e6, 250);
  EXPECT_NEAR(EnclosedVolume(box.vertices, box.triangles), 8, 1e-6);
  for (auto& triangle : box.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NEAR(EnclosedVolume(box.vertices, box.triangles), -8, 1e-6);
  EXPECT_EQ(EnclosedVolume({}, {}), 0);
}

TEST(SurfaceSmoothing, NoiseFallsAndEdgesStay) {
  const ObjectSurface box = NoisyBox();
  std::vector<Vector3d> x = box.vertices;
  SmoothKeepingEdges(box.triangles, std::vector<double>(x.size(), 1), 8, &x);
  EXPECT_LT(Error(x, false), 0.25 * Error(box.vertices, false));
  // Along the edges, where a smoother that does not know them would round them off by half a
  // square.
  EXPECT_LT(Error(x, true), 0.7 * Error(box.vertices, true));
  EXPECT_NEAR(EnclosedVolume(x, box.triangles), 8, 1e-3);
}

TEST(SurfaceSmoothing, TheVolumeIsTheOneAskedFor) {
  const ObjectSurface box = NoisyBox();
  for (const double volume : {7.5, 8.5}) {
    std::vector<Vector3d> x = box.vertices;
    SmoothKeepingEdges(box.triangles, std::vector<double>(x.size(), 1), volume, &x);
    EXPECT_NEAR(EnclosedVolume(x, box.triangles), volume, 2e-3);
  }
}

TEST(SurfaceSmoothing, NoVertexMovesFartherThanItMay) {
  const ObjectSurface box = NoisyBox();
  std::vector<double> max_move(box.vertices.size());
  for (size_t v = 0; v < max_move.size(); ++v) max_move[v] = v % 3 * 0.25 * kNoise;
  std::vector<Vector3d> x = box.vertices;
  SmoothKeepingEdges(box.triangles, max_move, 9, &x);
  int at_the_bound = 0;
  for (size_t v = 0; v < x.size(); ++v) {
    const double move = (x[v] - box.vertices[v]).norm();
    EXPECT_LE(move, max_move[v] * (1 + 1e-9));
    at_the_bound += v % 3 != 0 && move > 0.999 * max_move[v];
  }
  EXPECT_GT(at_the_bound, 100);
}

TEST(SurfaceSmoothing, FacesWithoutAreaDoNoHarm) {
  ObjectSurface box = BoxSurface(4);
  // Two neighbours in one place: the triangles between them have no area.
  const uint32_t a = box.triangles[0][0], b = box.triangles[0][1];
  box.vertices[b] = box.vertices[a];
  std::vector<Vector3d> x = box.vertices;
  SmoothKeepingEdges(box.triangles, std::vector<double>(x.size(), 1), 8, &x);
  for (const Vector3d& vertex : x) EXPECT_TRUE(vertex.allFinite());
  // All in one place.
  x.assign(x.size(), Vector3d(1, 2, 3));
  SmoothKeepingEdges(box.triangles, std::vector<double>(x.size(), 1), 8, &x);
  for (const Vector3d& vertex : x) EXPECT_TRUE(vertex.allFinite());
}

TEST(SurfaceSmoothing, TheSameOnAnyNumberOfThreads) {
  const ObjectSurface box = NoisyBox();
  std::vector<std::vector<Vector3d>> results;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    std::vector<Vector3d>& x = results.emplace_back(box.vertices);
    SmoothKeepingEdges(box.triangles, std::vector<double>(x.size(), 1), 8, &x);
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST(SurfaceSmoothing, SpikesAreCutAndCornersAndFixedVerticesStay) {
  const ObjectSurface box = BoxSurface(kSquares);
  std::vector<uint8_t> is_fixed(box.vertices.size(), 0);
  std::vector<Vector3d> x = box.vertices;
  CutSpikes(box.triangles, is_fixed, &x);
  EXPECT_EQ(x, box.vertices);

  // In the middle of a face, four squares high.
  const auto in_middle = [](const Vector3d& p) {
    return (p - Vector3d(0, 0, 1)).norm() < 0.1 / kSquares;
  };
  const auto spike = std::find_if(x.begin(), x.end(), in_middle);
  ASSERT_NE(spike, x.end());
  *spike += Vector3d(0, 0, 8.0 / kSquares);
  const std::vector<Vector3d> with_spike = x;
  CutSpikes(box.triangles, is_fixed, &x);
  EXPECT_LT(DistanceToBox(*spike), 2.0 / kSquares);
  EXPECT_EQ(std::mismatch(x.begin(), spike, box.vertices.begin()).first, spike);
  EXPECT_TRUE(std::equal(spike + 1, x.end(), box.vertices.end() - (x.end() - spike - 1)));

  is_fixed[spike - x.begin()] = 1;
  x = with_spike;
  CutSpikes(box.triangles, is_fixed, &x);
  EXPECT_EQ(x, with_spike);
}

}  // namespace
}  // namespace semfoam
