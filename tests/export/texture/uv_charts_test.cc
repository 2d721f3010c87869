// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/uv_charts.h"

#include "export/texture/triangle_raster.h"

#include <cmath>
#include <map>

#include "tests/export/texture/test_meshes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Twice the signed area of a triangle in the layout.
double Doubled(const UvCharts& charts, size_t f) {
  const Eigen::Vector2d a = charts.points[charts.triangles[f][0]];
  const Eigen::Vector2d ab = charts.points[charts.triangles[f][1]] - a;
  const Eigen::Vector2d ac = charts.points[charts.triangles[f][2]] - a;
  return ab.x() * ac.y() - ab.y() * ac.x();
}

// Expects that corners are those of the mesh, and that charts lie in their boxes, hardly folded.
void ExpectValid(const UvCharts& charts, const TestMesh& mesh) {
  ASSERT_EQ(charts.chart_of.size(), mesh.triangles.size());
  ASSERT_EQ(charts.triangles.size(), mesh.triangles.size());
  ASSERT_EQ(charts.points.size(), charts.vertex_of.size());
  std::map<uint32_t, uint32_t> chart_of_point;
  double upright = 0, turned_away = 0;
  for (size_t f = 0; f < mesh.triangles.size(); ++f) {
    ASSERT_LT(charts.chart_of[f], charts.sizes.size());
    for (int k = 0; k < 3; ++k) {
      const uint32_t p = charts.triangles[f][k];
      ASSERT_LT(p, charts.points.size());
      EXPECT_EQ(charts.vertex_of[p], mesh.triangles[f][k]);
      EXPECT_EQ(chart_of_point.emplace(p, charts.chart_of[f]).first->second, charts.chart_of[f]);
      EXPECT_GE(charts.points[p].minCoeff(), 0);
      EXPECT_LE((charts.points[p] - charts.sizes[charts.chart_of[f]]).maxCoeff(), 1e-12);
    }
    (Doubled(charts, f) > 0 ? upright : turned_away) += std::abs(Doubled(charts, f));
  }
  EXPECT_LE(turned_away, 0.005 * upright);
  EXPECT_EQ(chart_of_point.size(), charts.points.size());
}

// The share of the surface's area that the layout has.
double AreaShare(const UvCharts& charts, const TestMesh& mesh) {
  double area = 0;
  for (size_t f = 0; f < charts.triangles.size(); ++f) area += 0.5 * Doubled(charts, f);
  return area / mesh.Area();
}

// The share of the charts' places that more than one triangle of the chart covers; places on a
// side that two triangles share are among them.
double OverlapShare(const UvCharts& charts) {
  constexpr int kSize = 401;
  double covered = 0, twice = 0;
  for (uint32_t c = 0; c < charts.sizes.size(); ++c) {
    std::vector<int> layers(kSize * kSize, 0);
    const double scale = kSize / charts.sizes[c].maxCoeff();
    for (size_t f = 0; f < charts.triangles.size(); ++f) {
      if (charts.chart_of[f] != c) continue;
      std::array<Eigen::Vector2d, 3> corners;
      for (int k = 0; k < 3; ++k) corners[k] = scale * charts.points[charts.triangles[f][k]];
      ForEachCoveredPixel(corners, kSize, 0, kSize, [&](int x, int y, const Eigen::Vector3d&) {
        ++layers[y * kSize + x];
      });
    }
    for (const int layer : layers) {
      covered += layer > 0;
      twice += layer > 1;
    }
  }
  return twice / covered;
}

TEST(UvCharts, SidesOfACubeAreItsCharts) {
  const TestMesh mesh = Cube(6);
  const UvCharts charts = MakeUvCharts(mesh.vertices, mesh.triangles);
  ExpectValid(charts, mesh);
  ASSERT_EQ(charts.sizes.size(), 6u);
  // Single triangles at the cube's corners may go with another side, for normals are smoothed.
  for (const Eigen::Vector2d& size : charts.sizes) {
    EXPECT_NEAR(size.x(), 2, 0.2);
    EXPECT_NEAR(size.y(), 2, 0.2);
  }
  EXPECT_GT(AreaShare(charts, mesh), 0.85);
}

TEST(UvCharts, RoundSurfacesHaveFewChartsWithoutOverlaps) {
  for (const TestMesh& mesh : {Torus(), Cube(12, 1)}) {
    const UvCharts charts = MakeUvCharts(mesh.vertices, mesh.triangles);
    ExpectValid(charts, mesh);
    EXPECT_GE(charts.sizes.size(), 4u);
    EXPECT_LE(charts.sizes.size(), 24u);
    EXPECT_GT(AreaShare(charts, mesh), 0.75);
    EXPECT_LT(OverlapShare(charts), 0.01);
  }
}

// A ramp that winds around an axis with a hole, two turns: seen from above it covers itself.
TEST(UvCharts, SpiralsAreCut) {
  TestMesh mesh;
  constexpr int kSteps = 120;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 4 * std::numbers::pi * i / kSteps;
    for (const double r : {1.0, 1.5, 2.0}) {
      mesh.vertices.push_back({r * std::cos(angle), r * std::sin(angle), 0.2 * angle});
    }
  }
  for (uint32_t i = 0; i < kSteps; ++i) {
    for (uint32_t k = 0; k < 2; ++k) {
      const uint32_t a = 3 * i + k, b = a + 1, c = a + 3, d = a + 4;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  const UvCharts charts = MakeUvCharts(mesh.vertices, mesh.triangles);
  ExpectValid(charts, mesh);
  EXPECT_GE(charts.sizes.size(), 2u);
  EXPECT_LT(OverlapShare(charts), 0.01);
}

TEST(UvCharts, TrianglesWithoutAreaHaveAPlace) {
  TestMesh mesh = Cube(2);
  mesh.vertices[1] = mesh.vertices[0];
  const UvCharts charts = MakeUvCharts(mesh.vertices, mesh.triangles);
  ASSERT_EQ(charts.triangles.size(), mesh.triangles.size());
  for (const Eigen::Vector2d& point : charts.points) EXPECT_TRUE(point.allFinite());
}

TEST(UvCharts, NoSurfaceHasNoCharts) { EXPECT_TRUE(MakeUvCharts({}, {}).sizes.empty()); }

}  // namespace
}  // namespace semfoam
