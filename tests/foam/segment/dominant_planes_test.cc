// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/dominant_planes.h"

#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/foam/segment/shown_scenes.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr float kSpacing = 0.05f, kRadius = kSpacing / 2;

double DegreesBetween(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

// Nodes of a graph, each of weight 1, before they are connected.
struct Surface {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;

  void Add(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) {
    positions.push_back(position);
    normals.push_back(normal);
  }

  // Adds a rectangle of `columns` x `rows` cells around `middle`, with heights and normals that are
  // wrong by a normal distribution of `noise` radii and of `turn`, the tangent of the angle.
  void AddRectangle(int columns,
                    int rows,
                    const Eigen::Vector3f& middle,
                    const Eigen::Vector3f& normal,
                    double noise = 0,
                    double turn = 0) {
    const Eigen::Vector3f x = normal.unitOrthogonal(), y = normal.cross(x);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        CounterRandom random(5, 5, positions.size());
        const float at_x = kSpacing * (static_cast<float>(column) - 0.5f * (columns - 1));
        const float at_y = kSpacing * (static_cast<float>(row) - 0.5f * (rows - 1));
        const auto height = static_cast<float>(noise * kRadius * random.Normal());
        const auto turn_x = static_cast<float>(turn * random.Normal());
        const auto turn_y = static_cast<float>(turn * random.Normal());
        Add(middle + at_x * x + at_y * y + height * normal,
            (normal + turn_x * x + turn_y * y).normalized());
      }
    }
  }

  // Connects nodes that are less than 1.9 spacings apart.
  SurfaceGraph Graph() const {
    SurfaceGraph graph;
    const auto count = static_cast<uint32_t>(positions.size());
    graph.positions = positions;
    graph.normals = normals;
    graph.radii.assign(count, kRadius);
    graph.weights.assign(count, 1.f);
    graph.colors.assign(count, Eigen::Vector3f::Constant(0.5f));
    graph.offsets.push_back(0);
    for (uint32_t node = 0; node < count; ++node) {
      graph.cells.push_back(node);
      graph.node_of_cell.push_back(static_cast<int32_t>(node));
      for (uint32_t other = 0; other < count; ++other) {
        if (other == node || (positions[other] - positions[node]).norm() > 1.9f * kSpacing)
          continue;
        graph.neighbors.push_back(other);
        graph.face_areas.push_back(kSpacing * kSpacing);
      }
      graph.offsets.push_back(static_cast<uint32_t>(graph.neighbors.size()));
    }
    return graph;
  }
};

// A ball of `count` cells, a Fibonacci sphere with kSpacing between them.
Surface Ball(int count) {
  const double radius = kSpacing * std::sqrt(count / (4 * std::numbers::pi));
  const double golden = std::numbers::pi * (3 - std::sqrt(5.));
  Surface ball;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.) / count, around = std::sqrt(1 - z * z);
    const Eigen::Vector3d direction(
        around * std::cos(golden * i), around * std::sin(golden * i), z);
    ball.Add((radius * direction).cast<float>(), direction.cast<float>());
  }
  return ball;
}

TEST(DominantPlanes, FindsAPlaneOfKnownEquationInNoise) {
  for (const Eigen::Vector3f& direction : {Eigen::Vector3f(0, 0, 1),
                                           Eigen::Vector3f(0, -1, 0),
                                           Eigen::Vector3f(1, 2, -3),
                                           Eigen::Vector3f(-2, 1, 0.1f)}) {
    SCOPED_TRACE(testing::Message() << direction.transpose());
    const Eigen::Vector3f normal = direction.normalized(), middle(0.3f, -0.7f, 0.2f);
    Surface surface;
    surface.AddRectangle(40, 30, middle, normal, /*noise=*/0.5, /*turn=*/0.15);
    // A third as much of anything, anywhere.
    for (int i = 0; i < 400; ++i) {
      CounterRandom random(6, 6, i);
      const Eigen::Vector3d place(random.Uniform(), random.Uniform(), random.Uniform());
      surface.Add(middle + (2 * place.array() - 1).matrix().cast<float>(),
                  RandomDirection(&random).cast<float>());
    }
    const std::vector<DominantPlane> planes = FindDominantPlanes(surface.Graph(), 0.2);
    ASSERT_EQ(planes.size(), 1u);
    const DominantPlane& plane = planes[0];
    EXPECT_NEAR(plane.normal.norm(), 1, 1e-5);
    EXPECT_LT(DegreesBetween(plane.normal, normal), 0.5);
    EXPECT_LT(std::abs(plane.Height(middle)), 0.1f * kRadius);
    EXPECT_EQ(plane.radius, kRadius);
    EXPECT_TRUE(std::is_sorted(plane.nodes.begin(), plane.nodes.end()));
    const auto wrong =
        std::count_if(plane.nodes.begin(), plane.nodes.end(), [](uint32_t i) { return i >= 1200; });
    EXPECT_GT(std::ssize(plane.nodes) - wrong, 1150);
    EXPECT_LT(wrong, 20);
  }
}

TEST(DominantPlanes, CountsByWhatPhotosShow) {
  Surface surface;
  surface.AddRectangle(30, 30, Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ());
  surface.AddRectangle(10, 10, {0, 0, 3}, Eigen::Vector3f::UnitX());
  SurfaceGraph graph = surface.Graph();
  ASSERT_EQ(FindDominantPlanes(graph, 0.2).size(), 1u);
  std::fill(graph.weights.begin() + 900, graph.weights.end(), 20.f);
  const std::vector<DominantPlane> planes = FindDominantPlanes(graph, 0.2);
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_GT(planes[0].normal.x(), 0.99f);
  EXPECT_GT(planes[1].normal.z(), 0.99f);
}

TEST(DominantPlanes, ParallelPlanesAreTwo) {
  // Two shelves that look the same way, and the two sides of a board.
  for (const float side : {1.f, -1.f}) {
    const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
    const float apart = side > 0 ? 6 * kRadius : kRadius;
    Surface surface;
    surface.AddRectangle(40, 30, Eigen::Vector3f::Zero(), up, /*noise=*/0.3, /*turn=*/0.1);
    surface.AddRectangle(30, 30, -apart * up, side * up, /*noise=*/0.3, /*turn=*/0.1);
    const std::vector<DominantPlane> planes = FindDominantPlanes(surface.Graph(), 0.2);
    ASSERT_EQ(planes.size(), 2u) << side;
    EXPECT_GT(planes[0].normal.z(), 0.999f);
    EXPECT_GT(side * planes[1].normal.z(), 0.999f);
    EXPECT_NEAR(planes[0].Height(-apart * up), -apart, 0.1f * kRadius);
    EXPECT_NEAR(planes[1].Height(-apart * up), 0, 0.1f * kRadius);
    EXPECT_LT(planes[0].nodes.back(), 1200u);
    EXPECT_GE(planes[1].nodes.front(), 1200u);
  }
}

TEST(DominantPlanes, PartsOfAPlaneCountFromThreeTenthsOn) {
  // What photos show of a floor beside and behind a box, and a tile.
  Surface surface;
  surface.AddRectangle(30, 30, Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ());
  surface.AddRectangle(10, 10, {2, 0, 0}, Eigen::Vector3f::UnitZ());
  surface.AddRectangle(5, 5, {4, 0, 0}, Eigen::Vector3f::UnitZ());
  const std::vector<DominantPlane> planes = FindDominantPlanes(surface.Graph(), 0.3);
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_EQ(planes[0].nodes.size(), 900u);
  EXPECT_EQ(planes[1].nodes.size(), 100u);
  EXPECT_EQ(planes[0].normal, planes[1].normal);
  EXPECT_EQ(planes[0].point, planes[1].point);
}

TEST(DominantPlanes, PatchesThatDoNotTouchAreNone) {
  Surface surface;
  for (int i = 0; i < 100; ++i) {
    surface.Add({0.5f * (i % 10), 0.5f * (i / 10), 0}, Eigen::Vector3f::UnitZ());
  }
  EXPECT_TRUE(FindDominantPlanes(surface.Graph(), 0.04).empty());
}

TEST(DominantPlanes, TooFewCellsAreNone) {
  Surface surface;
  EXPECT_TRUE(FindDominantPlanes(surface.Graph(), 0.04).empty());
  surface.Add({0, 0, 0}, Eigen::Vector3f::UnitZ());
  EXPECT_TRUE(FindDominantPlanes(surface.Graph(), 0.04).empty());
  surface.Add({kSpacing, 0, 0}, Eigen::Vector3f::UnitZ());
  EXPECT_TRUE(FindDominantPlanes(surface.Graph(), 0.04).empty());
  surface.Add({0, kSpacing, 0}, Eigen::Vector3f::UnitZ());
  const std::vector<DominantPlane> planes = FindDominantPlanes(surface.Graph(), 0.04);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].nodes, (std::vector<uint32_t>{0, 1, 2}));
  EXPECT_LT(DegreesBetween(planes[0].normal, Eigen::Vector3f::UnitZ()), 1e-3);
}

TEST(DominantPlanes, ARowOfCellsKeepsTheirNormal) {
  for (const Eigen::Vector3f& along : {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(1, 2, 0)}) {
    Surface surface;
    for (int i = 0; i < 200; ++i) {
      surface.Add(kSpacing * static_cast<float>(i) * along.normalized(), Eigen::Vector3f::UnitZ());
    }
    const std::vector<DominantPlane> planes = FindDominantPlanes(surface.Graph(), 0.04);
    ASSERT_EQ(planes.size(), 1u);
    EXPECT_EQ(planes[0].nodes.size(), 200u);
    EXPECT_LT(DegreesBetween(planes[0].normal, Eigen::Vector3f::UnitZ()), 1e-3);
  }
}

TEST(DominantPlanes, TwinCellsDoNotSpoilAPlane) {
  Surface surface;
  surface.AddRectangle(30, 30, Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ(), 0.3, 0.1);
  SurfaceGraph graph = surface.Graph();
  for (size_t i = 0; i < graph.radii.size(); i += 90) graph.radii[i] = i % 180 == 0 ? 0.f : 1e-12f;
  const std::vector<DominantPlane> planes = FindDominantPlanes(graph, 0.04);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_GT(planes[0].nodes.size(), 850u);
  EXPECT_GT(planes[0].normal.z(), 0.999f);
}

TEST(DominantPlanes, ABallIsNone) {
  EXPECT_TRUE(FindDominantPlanes(Ball(12000).Graph(), 0.04).empty());
}

TEST(DominantPlanes, ABallOnATableIsNotOfItsPlane) {
  Surface surface;
  surface.AddRectangle(60, 60, Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ());
  const Surface ball = Ball(1000);
  const float top = ball.positions.front().z();
  for (size_t i = 0; i < ball.positions.size(); ++i) {
    surface.Add(ball.positions[i] + Eigen::Vector3f(0, 0, top), ball.normals[i]);
  }
  const std::vector<DominantPlane> planes = FindDominantPlanes(surface.Graph(), 0.04);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].nodes.size(), 3600u);
  EXPECT_EQ(planes[0].nodes.back(), 3599u);
}

TEST(DominantPlanes, AreTheSameOnAnyNumberOfThreads) {
  const SurfaceGraph graph = GraphOf(TableModel());
  const auto find = [&](int threads) {
    const ThreadLimit limit(threads);
    return FindDominantPlanes(graph, 0.04);
  };
  const std::vector<DominantPlane> one = find(1);
  ASSERT_GE(one.size(), 1u);
  for (const int threads : {2, 5}) {
    const std::vector<DominantPlane> planes = find(threads);
    ASSERT_EQ(planes.size(), one.size());
    for (size_t p = 0; p < one.size(); ++p) {
      EXPECT_EQ(planes[p].normal, one[p].normal);
      EXPECT_EQ(planes[p].point, one[p].point);
      EXPECT_EQ(planes[p].nodes, one[p].nodes);
    }
  }
}

TEST(PlaneFootprint, IsWhereThePlaneHasCells) {
  Surface surface;
  surface.AddRectangle(40, 40, {10, 20, 0}, Eigen::Vector3f::UnitZ());
  const SurfaceGraph graph = surface.Graph();
  const std::vector<DominantPlane> planes = FindDominantPlanes(graph, 0.04);
  ASSERT_EQ(planes.size(), 1u);
  const PlaneFootprint footprint(graph, planes[0]);
  // At any height.
  EXPECT_TRUE(footprint.IsAt({10, 20, 5}, 0));
  EXPECT_TRUE(footprint.IsAt({10.9f, 19.1f, -5}, 0));
  EXPECT_FALSE(footprint.IsAt({11.3f, 20, 0}, 0));
  EXPECT_TRUE(footprint.IsAt({11.05f, 20, 0}, 1));
  EXPECT_TRUE(footprint.IsAt({11.3f, 20, 0}, 4));
  for (const float far : {1e6f, 1e12f, 1e30f}) {
    EXPECT_FALSE(footprint.IsAt({far, -far, 0}, 2)) << far;
  }
}

}  // namespace
}  // namespace semfoam
