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

// The vertex in the middle of the box's upper face.
size_t MiddleOfTop(const ObjectSurface& box) {
  const auto in_middle = [](const Vector3d& p) {
    return (p - Vector3d(0, 0, 1)).norm() < 0.1 / kSquares;
  };
  const auto middle = std::find_if(box.vertices.begin(), box.vertices.end(), in_middle);
  EXPECT_NE(middle, box.vertices.end());
  return middle - box.vertices.begin();
}

TEST(SurfaceSmoothing, DentsAreFilledAndBumpsGoWhereTheyMay) {
  constexpr double kDepth = 6.0 / kSquares;
  const ObjectSurface box = BoxSurface(kSquares);
  const size_t middle = MiddleOfTop(box);
  const std::vector<double> radii(box.vertices.size(), 1.0 / kSquares);
  const auto faired = [&](double height, VertexMove move) {
    std::vector<Vector3d> x = box.vertices;
    x[middle].z() += height;
    FairOutliers(box.triangles, radii, std::vector<VertexMove>(x.size(), move), &x);
    return x;
  };
  EXPECT_GT(faired(-kDepth, VertexMove::kOutwards)[middle].z(), 1 - 0.3 * kDepth);
  EXPECT_GT(faired(-kDepth, VertexMove::kBothWays)[middle].z(), 1 - 0.3 * kDepth);
  EXPECT_LT(faired(kDepth, VertexMove::kBothWays)[middle].z(), 1 + 0.3 * kDepth);
  EXPECT_EQ(faired(kDepth, VertexMove::kOutwards)[middle].z(), 1 + kDepth);
  EXPECT_EQ(faired(-kDepth, VertexMove::kNone)[middle].z(), 1 - kDepth);
}

TEST(SurfaceSmoothing, FairingLeavesEdgesAndWhatStandsOut) {
  // A stud of eight squares by eight, three high, on the upper face.
  constexpr double kHigh = 6.0 / kSquares;
  ObjectSurface box = BoxSurface(kSquares);
  const size_t middle = MiddleOfTop(box);
  const auto is_stud = [](const Vector3d& p) {
    return p.z() > 1 - 0.1 / kSquares && p.head<2>().cwiseAbs().maxCoeff() < 8.1 / kSquares;
  };
  for (Vector3d& p : box.vertices) {
    if (is_stud(p)) p.z() += kHigh;
  }
  std::vector<Vector3d> x = box.vertices;
  FairOutliers(box.triangles,
               std::vector<double>(x.size(), 1.0 / kSquares),
               std::vector<VertexMove>(x.size(), VertexMove::kOutwards),
               &x);
  EXPECT_NEAR(x[middle].z(), 1 + kHigh, 0.1 * kHigh);
  for (size_t v = 0; v < x.size(); ++v) {
    // Convex edges stay where they are; from the stud's foot the box's sides are far away.
    if (x[v].z() < 0.5) {
      EXPECT_LT((x[v] - box.vertices[v]).norm(), 0.2 / kSquares) << v;
    }
    EXPECT_GE(x[v].z(), box.vertices[v].z() - 0.2 / kSquares) << v;
  }
}

TEST(SurfaceSmoothing, FairingHardCases) {
  ObjectSurface box = BoxSurface(4);
  const std::vector<VertexMove> moves(box.vertices.size(), VertexMove::kBothWays);
  // Cells without a radius, faces without an area, all in one place.
  const std::vector<double> radii(box.vertices.size(), 0);
  std::vector<Vector3d> x = box.vertices;
  x[box.triangles[0][1]] = x[box.triangles[0][0]];
  FairOutliers(box.triangles, radii, moves, &x);
  for (const Vector3d& vertex : x) EXPECT_TRUE(vertex.allFinite());
  x.assign(x.size(), Vector3d(1, 2, 3));
  FairOutliers(box.triangles, radii, moves, &x);
  for (const Vector3d& vertex : x) EXPECT_EQ(vertex, Vector3d(1, 2, 3));
  std::vector<Vector3d> none;
  FairOutliers({}, {}, {}, &none);
  EXPECT_TRUE(none.empty());
}

TEST(SurfaceSmoothing, FairingIsTheSameOnAnyNumberOfThreads) {
  const ObjectSurface box = NoisyBox();
  const std::vector<double> radii(box.vertices.size(), 1.0 / kSquares);
  const std::vector<VertexMove> moves(box.vertices.size(), VertexMove::kBothWays);
  std::vector<std::vector<Vector3d>> results;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    FairOutliers(box.triangles, radii, moves, &results.emplace_back(box.vertices));
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
  const auto spike = x.begin() + MiddleOfTop(box);
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
