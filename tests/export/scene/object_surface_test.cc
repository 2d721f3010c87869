// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_surface.h"

#include "foam/geometry/voronoi.h"

#include <algorithm>
#include <set>

#include "tests/export/surface/openmesh_check.h"
#include "tests/export/surface/surface_checks.h"
#include "tests/export/test_foams.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// The cells' volumes in world units: pyramids over their faces, all in double.
double VolumeOfCells(const ExportableScene& scene, const ObjectInfo& object) {
  const std::vector<double> areas =
      FaceAreas(scene.cell_positions, scene.delaunay, scene.voronoi_vertices);
  double volume = 0;
  for (const uint32_t i : object.cells) {
    for (uint32_t e = scene.delaunay.offsets[i]; e < scene.delaunay.offsets[i + 1]; ++e) {
      const Eigen::Vector3d from = scene.cell_positions[i].cast<double>();
      const Eigen::Vector3d to = scene.cell_positions[scene.delaunay.neighbors[e]].cast<double>();
      volume += areas[e] * (to - from).norm() / 6;
    }
  }
  return volume * std::pow(scene.world_from_normalized.scale, 3);
}

// What must hold for every object of every bounded foam.
void ExpectSoundSurfaces(const Model& model) {
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_FALSE(scene.objects.empty());
  for (const ObjectInfo& object : scene.objects) {
    SCOPED_TRACE("object " + object.name);
    const ObjectSurface surface = ExtractSurface(scene, object);
    EXPECT_EQ(surface.object_id, object.id);
    ExpectClosedManifold(surface);

    const double volume = VolumeOfCells(scene, object);
    EXPECT_NEAR(EnclosedVolume(surface), volume, 1e-9 * volume);
    EXPECT_NEAR(object.volume, volume, 1e-9 * volume);

    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& vertex : surface.vertices) box.extend(vertex);
    EXPECT_EQ(box.min(), object.bounding_box.min());
    EXPECT_EQ(box.max(), object.bounding_box.max());

    ExpectClosedForOpenMesh(surface);
  }
}

TEST(ObjectSurface, BallsThatTouch) { ExpectSoundSurfaces(TouchingBalls()); }

TEST(ObjectSurface, EveryCellDrawsItsClassByLot) {
  for (const unsigned seed : {1u, 2u, 3u}) ExpectSoundSurfaces(ClassesByLot(seed));
}

TEST(ObjectSurface, CosphericalSites) {
  // The surface has faces without area, and stays a manifold.
  for (const Model& model : {CubeInAGrid(), LotsInAGrid(), BallInANearGrid()}) {
    ExpectSoundSurfaces(model);
  }
}

TEST(ObjectSurface, ASingleCell) {
  const Model model = MakeModel(GridSites(5, 0.25f, 0, 0), 1, [](const Eigen::Vector3f& p) {
    return p.norm() < 0.1f ? 0 : kAir;
  });
  ExpectSoundSurfaces(model);
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects[0].cells.size(), 1u);
  const ObjectSurface surface = ExtractSurface(scene, scene.objects[0]);
  EXPECT_EQ(EulerCharacteristic(surface), 2);
  EXPECT_NEAR(EnclosedVolume(surface), 1.0 / 64, 1e-15);
}

TEST(ObjectSurface, CellsThatTouchInAnEdgeOrAVertexOnly) {
  for (const Eigen::Vector3f& other : {Eigen::Vector3f(0.25f, 0.25f, 0),
                                       Eigen::Vector3f(0.25f, -0.25f, 0),
                                       Eigen::Vector3f(0.25f, 0.25f, 0.25f),
                                       Eigen::Vector3f(-0.25f, 0.25f, 0.25f),
                                       Eigen::Vector3f(0.25f, -0.25f, 0.25f),
                                       Eigen::Vector3f(0.25f, 0.25f, -0.25f)}) {
    SCOPED_TRACE(other.transpose());
    ExpectSoundSurfaces(MakeModel(GridSites(7, 0.25f, 0, 0), 1, [&](const Eigen::Vector3f& p) {
      return p.norm() < 0.1f || (p - other).norm() < 0.1f ? 0 : kAir;
    }));
  }
}

TEST(ObjectSurface, ATorusKeepsItsHole) {
  const Model model = Torus();
  ExpectSoundSurfaces(model);
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(EulerCharacteristic(ExtractSurface(scene, scene.objects[0])), 0);
}

TEST(ObjectSurface, AShellHasTwoSidesUnlessItsHollowIsFilled) {
  const Model model = MakeModel(GridSites(16, 0.125f, 0.2f, 2), 1, [](const Eigen::Vector3f& p) {
    return p.norm() < 0.7f && p.norm() > 0.35f ? 0 : kAir;
  });
  ExpectSoundSurfaces(model);
  const ExportableScene filled = MakeExportableScene(model);
  EXPECT_EQ(EulerCharacteristic(ExtractSurface(filled, filled.objects[0])), 2);
  ExportableSceneOptions options;
  options.fill_hidden_space = false;
  const ExportableScene shell = MakeExportableScene(model, options);
  const ObjectSurface surface = ExtractSurface(shell, shell.objects[0]);
  ExpectClosedManifold(surface);
  EXPECT_EQ(EulerCharacteristic(surface), 4);
}

TEST(ObjectSurface, CellsAtTheRimOfTheFoamAreClosedToo) {
  // Everything is matter: the surface lies between the outermost cells and the guards.
  const ExportableScene scene =
      MakeExportableScene(MakeModel(RandomSites(300, 9), 1, [](const auto&) { return 0; }));
  const ObjectSurface surface = ExtractSurface(scene, scene.objects[0]);
  ExpectClosedManifold(surface);
  for (const Eigen::Vector3d& vertex : surface.vertices) EXPECT_TRUE(vertex.allFinite());
}

TEST(ObjectSurface, FewAndCoplanarSites) {
  for (const std::vector<Eigen::Vector3f>& sites :
       {std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}},
        std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
        std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}}) {
    const ExportableScene scene = MakeExportableScene(
        MakeModel(sites, 1, [](const Eigen::Vector3f& p) { return p.x() < 0.5f ? 0 : kAir; }));
    ASSERT_EQ(scene.objects.size(), 1u);
    ExpectClosedManifold(ExtractSurface(scene, scene.objects[0]));
  }
}

TEST(ObjectSurface, NeighboursShareTheVerySameTriangles) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls());
  const ObjectSurface a = ExtractSurface(scene, scene.objects[0]);
  const ObjectSurface b = ExtractSurface(scene, scene.objects[1]);
  using Triangle = std::array<std::array<double, 3>, 3>;
  // The triangles on the side towards the other object; each begins with its smallest corner.
  const auto shared = [&](const ObjectSurface& surface, int32_t other, bool reversed) {
    std::multiset<Triangle> triangles;
    for (size_t f = 0; f < surface.triangles.size(); ++f) {
      const uint32_t outer = surface.triangle_cells[f][1];
      if (outer >= scene.NumSites() || scene.object_of_cell[outer] != other) continue;
      Triangle triangle;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d& x = surface.vertices[surface.triangles[f][reversed ? 2 - k : k]];
        triangle[k] = {x.x(), x.y(), x.z()};
      }
      std::rotate(
          triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
      triangles.insert(triangle);
    }
    return triangles;
  };
  const auto from_a = shared(a, 1, false);
  EXPECT_GT(from_a.size(), 10u);
  EXPECT_EQ(from_a, shared(b, 0, true));
}

TEST(ObjectSurface, TrianglesFaceAwayFromTheObject) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls());
  const ObjectSurface surface = ExtractSurface(scene, scene.objects[0]);
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    const auto& t = surface.triangles[f];
    const Eigen::Vector3d area = (surface.vertices[t[1]] - surface.vertices[t[0]])
                                     .cross(surface.vertices[t[2]] - surface.vertices[t[0]]);
    const auto& [inner, outer] = surface.triangle_cells[f];
    const Eigen::Vector3d outwards =
        (scene.cell_positions[outer] - scene.cell_positions[inner]).cast<double>();
    // Not for triangles of next to no area, whose direction is rounding.
    if (area.norm() > 1e-12) {
      EXPECT_GT(area.dot(outwards), 0.99 * area.norm() * outwards.norm());
    }
  }
}

TEST(ObjectSurface, FacesShowTheirCellAndVerticesTheMean) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls());
  const ObjectInfo& object = scene.objects[1];
  const ObjectSurface surface = ExtractSurface(scene, object);
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    const uint32_t cell = surface.triangle_cells[f][0];
    EXPECT_EQ(scene.object_of_cell[cell], 1);
    EXPECT_EQ(surface.face_confidence[f], scene.labels.confidence[cell]);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(surface.face_color[f][c], 255 * scene.display_color[cell][c], 0.501);
    }
  }
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    float confidence = 0;
    int count = 0;
    for (const uint32_t cell : scene.delaunay.tets[surface.vertex_tet[v]]) {
      if (cell >= scene.NumSites() || scene.object_of_cell[cell] != 1) continue;
      color += scene.display_color[cell];
      confidence += scene.labels.confidence[cell];
      ++count;
    }
    ASSERT_GE(count, 1);
    EXPECT_NEAR(surface.vertex_confidence[v], confidence / count, 1e-6);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(surface.vertex_color[v][c], 255 * color[c] / count, 0.502);
    }
  }
}

TEST(ObjectSurface, FarFromTheWorldsOriginItIsTheSameToTheMillimetre) {
  Model model = TouchingBalls();
  model.world_from_normalized = {50, {0, 0, 0}};
  const ExportableScene near = MakeExportableScene(model);
  const Eigen::Vector3d offset(5e5, 4.5e6, 250);
  model.world_from_normalized.translation = offset;
  const ExportableScene far = MakeExportableScene(model);
  const ObjectSurface at_origin = ExtractSurface(near, near.objects[0]);
  const ObjectSurface at_utm = ExtractSurface(far, far.objects[0]);
  EXPECT_EQ(at_origin.triangles, at_utm.triangles);
  ASSERT_EQ(at_origin.vertices.size(), at_utm.vertices.size());
  for (size_t v = 0; v < at_origin.vertices.size(); ++v) {
    EXPECT_LT((at_utm.vertices[v] - offset - at_origin.vertices[v]).norm(), 1e-6);
  }
  EXPECT_DOUBLE_EQ(far.objects[0].volume, near.objects[0].volume);
}

TEST(ObjectSurface, SpikesIntoEmptySpaceAreCounted) {
  // A cluster of cells with nothing around it for a long way reaches out to the guards.
  std::vector<Eigen::Vector3f> sites = GridSites(5, 0.01f, 0.2f, 1);
  const ExportableScene bare =
      MakeExportableScene(MakeModel(sites, 1, [](const Eigen::Vector3f& p) {
        return p.x() > 0.015f || p.norm() < 0.012f ? 0 : kAir;
      }));
  EXPECT_GT(CountFarVertices(bare, ExtractSurface(bare, bare.objects[0])), 0);
  const ExportableScene bounded = MakeExportableScene(TouchingBalls());
  EXPECT_EQ(CountFarVertices(bounded, ExtractSurface(bounded, bounded.objects[0])), 0);
}

}  // namespace
}  // namespace semfoam
