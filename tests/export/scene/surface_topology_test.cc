// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/surface_topology.h"

#include "export/scene/object_surface.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_decimation.h"

#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

struct Expected {
  int components = 1;
  int64_t cavities = 0;
  int64_t genus = 0;
};

Model InAGrid(const std::function<bool(const Eigen::Vector3f&)>& is_matter) {
  return MakeModel(
      GridSites(24, 0.08f, 0.2f, 7), 1, [&](const auto& p) { return is_matter(p) ? 0 : kAir; });
}

void ExpectTopology(const std::string& what, const Model& model, const Expected& expected) {
  ExportableSceneOptions options;
  options.fill_hidden_space = false;
  options.min_component_share = 0;
  const ExportableScene scene = MakeExportableScene(model, options);
  ASSERT_EQ(scene.objects.size(), 1u) << what;
  const ObjectInfo& object = scene.objects[0];
  EXPECT_EQ(object.components, expected.components) << what;
  EXPECT_EQ(object.cavities, expected.cavities) << what;
  EXPECT_EQ(object.genus, expected.genus) << what;
  // What is written is so, whatever the method.
  const ObjectSurface cells = ExtractSurface(scene, object);
  const ObjectSurface smooth = ExtractSmoothSurface(scene, object, cells);
  for (const ObjectSurface& surface : {cells, smooth, Decimate(smooth, 300), Decimate(smooth, 4)}) {
    const SurfaceTopology topology = TopologyOf(surface.vertices.size(), surface.triangles);
    EXPECT_EQ(topology.shells, expected.components + expected.cavities) << what;
    EXPECT_EQ(topology.genus, expected.genus) << what;
    EXPECT_EQ(NumCavities(topology, object.components), expected.cavities) << what;
  }
}

bool InBall(const Eigen::Vector3f& p, float x, float radius) {
  return (p - Eigen::Vector3f(x, 0, 0)).norm() < radius;
}

bool InRing(const Eigen::Vector3f& p, float x) {
  return std::hypot(std::hypot(p.x() - x, p.y()) - 0.25f, p.z()) < 0.12f;
}

TEST(SurfaceTopology, BodiesOfKnownTopology) {
  ExpectTopology("ball", InAGrid([](const auto& p) { return InBall(p, 0, 0.5f); }), {1, 0, 0});
  ExpectTopology("torus", Torus(), {1, 0, 1});
  ExpectTopology(
      "two balls",
      InAGrid([](const auto& p) { return InBall(p, -0.4f, 0.3f) || InBall(p, 0.4f, 0.3f); }),
      {2, 0, 0});
  ExpectTopology(
      "ball with a void",
      InAGrid([](const auto& p) { return InBall(p, 0, 0.7f) && !InBall(p, 0.1f, 0.3f); }),
      {1, 1, 0});
  ExpectTopology("ball in a ball",
                 InAGrid([](const auto& p) {
                   return InBall(p, 0, 0.2f) || (InBall(p, 0, 0.8f) && !InBall(p, 0, 0.5f));
                 }),
                 {2, 1, 0});
  ExpectTopology("two rings",
                 InAGrid([](const auto& p) { return InRing(p, -0.5f) || InRing(p, 0.5f); }),
                 {2, 0, 2});
  ExpectTopology("torus-shaped void",
                 InAGrid([](const auto& p) { return InBall(p, 0, 0.75f) && !InRing(p, 0); }),
                 {1, 1, 1});
  ExpectTopology("ball with two voids",
                 InAGrid([](const auto& p) {
                   return InBall(p, 0, 0.8f) && !InBall(p, -0.35f, 0.2f) && !InBall(p, 0.35f, 0.2f);
                 }),
                 {1, 2, 0});
}

// Shells counted by the triangles' neighbours and cavities by the sign of their volume, on surfaces
// of cells that are drawn by lot.
TEST(SurfaceTopology, AgreesWithShellsLookedAtOneByOne) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    ExportableSceneOptions options;
    options.min_component_share = 0;
    const ExportableScene scene = MakeExportableScene(ClassesByLot(seed), options);
    for (const ObjectInfo& object : scene.objects) {
      const ObjectSurface surface = ExtractSurface(scene, object);
      std::vector<std::vector<size_t>> triangles_at(surface.vertices.size());
      for (size_t t = 0; t < surface.triangles.size(); ++t) {
        for (const uint32_t vertex : surface.triangles[t]) triangles_at[vertex].push_back(t);
      }
      std::vector<uint8_t> visited(surface.triangles.size(), 0);
      int64_t shells = 0, cavities = 0, genus = 0;
      for (size_t start = 0; start < surface.triangles.size(); ++start) {
        if (visited[start]) continue;
        std::vector<size_t> shell = {start};
        visited[start] = 1;
        std::set<uint32_t> vertices;
        double volume = 0;
        for (size_t k = 0; k < shell.size(); ++k) {
          const auto& triangle = surface.triangles[shell[k]];
          volume += surface.vertices[triangle[0]].dot(
              surface.vertices[triangle[1]].cross(surface.vertices[triangle[2]]));
          for (const uint32_t vertex : triangle) {
            vertices.insert(vertex);
            for (const size_t next : triangles_at[vertex]) {
              if (visited[next]) continue;
              visited[next] = 1;
              shell.push_back(next);
            }
          }
        }
        ++shells;
        cavities += volume < 0;
        const auto euler =
            static_cast<int64_t>(vertices.size()) - static_cast<int64_t>(shell.size() / 2);
        genus += (2 - euler) / 2;
      }
      const SurfaceTopology topology = TopologyOf(surface.vertices.size(), surface.triangles);
      EXPECT_EQ(topology.shells, shells);
      EXPECT_EQ(topology.genus, genus);
      EXPECT_EQ(object.cavities, cavities);
      EXPECT_EQ(object.genus, genus);
      EXPECT_GT(genus, 0) << "a hard case";
    }
  }
}

TEST(SurfaceTopology, IsSaidInWords) {
  EXPECT_EQ(TopologySummary({1, 1}, 1), "1 shell, no cavities, genus 1");
  EXPECT_EQ(TopologySummary({9, 0}, 1), "9 shells, 8 of them cavities, genus 0");
  EXPECT_EQ(TopologySummary({3, 2}, 2), "3 shells, 1 of them a cavity, genus 2");
}

}  // namespace
}  // namespace semfoam
