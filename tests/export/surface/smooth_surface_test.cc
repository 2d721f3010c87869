// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/smooth_surface.h"

#include "export/surface/surface_geometry.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>

#include "tests/export/surface/openmesh_check.h"
#include "tests/export/surface/surface_checks.h"
#include "tests/export/test_foams.h"
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;
using ::testing::IsEmpty;

ObjectSurface Smooth(const ExportableScene& scene, size_t object = 0) {
  return ExtractSmoothSurface(
      scene, scene.objects[object], ExtractSurface(scene, scene.objects[object]));
}

// CGAL's opinion of the surface.
void ExpectValidForCgal(const ObjectSurface& surface, bool bounds_a_volume) {
  using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
  using Mesh = CGAL::Surface_mesh<Point>;
  Mesh mesh;
  for (const Vector3d& x : surface.vertices) mesh.add_vertex(Point(x.x(), x.y(), x.z()));
  for (const auto& [a, b, c] : surface.triangles) {
    ASSERT_NE(mesh.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c)),
              Mesh::null_face());
  }
  EXPECT_TRUE(CGAL::is_valid_polygon_mesh(mesh));
  EXPECT_TRUE(CGAL::is_closed(mesh));
  EXPECT_TRUE(CGAL::is_triangle_mesh(mesh));
  // Nested pieces alternate, the outermost face outwards.
  if (bounds_a_volume) {
    EXPECT_TRUE(CGAL::Polygon_mesh_processing::does_bound_a_volume(mesh));
    EXPECT_TRUE(CGAL::Polygon_mesh_processing::is_outward_oriented(mesh));
  }
}

// What must hold for every object of every bounded foam. In exact grids tetrahedra have no volume,
// and triangles in them touch each other.
void ExpectSoundSmoothSurfaces(const Model& model, bool has_flat_tets = false) {
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_FALSE(scene.objects.empty());
  for (const ObjectInfo& object : scene.objects) {
    SCOPED_TRACE("object " + object.name);
    const ObjectSurface cells = ExtractSurface(scene, object);
    const ObjectSurface surface = ExtractSmoothSurface(scene, object, cells);
    EXPECT_EQ(surface.object_id, object.id);
    EXPECT_EQ(surface.object_name, object.name);
    ExpectClosedManifold(surface);
    EXPECT_EQ(EulerCharacteristic(surface), EulerCharacteristic(cells));
    EXPECT_GT(EnclosedVolume(surface), 0);
    EXPECT_LT(EnclosedVolume(surface), 1.05 * EnclosedVolume(cells));
    const auto crossing = SelfIntersections(surface.vertices, surface.triangles);
    if (!has_flat_tets) {
      EXPECT_THAT(crossing, IsEmpty());
    }
    ExpectValidForCgal(surface, crossing.empty());
    ExpectClosedForOpenMesh(surface);
  }
}

TEST(SmoothSurface, BallsThatTouch) { ExpectSoundSmoothSurfaces(TouchingBalls()); }

TEST(SmoothSurface, EveryCellDrawsItsClassByLot) {
  for (const unsigned seed : {1u, 2u, 3u}) ExpectSoundSmoothSurfaces(ClassesByLot(seed));
}

TEST(SmoothSurface, CosphericalSites) {
  ExpectSoundSmoothSurfaces(CubeInAGrid(), /*has_flat_tets=*/true);
  ExpectSoundSmoothSurfaces(LotsInAGrid(), /*has_flat_tets=*/true);
  ExpectSoundSmoothSurfaces(BallInANearGrid());
}

TEST(SmoothSurface, ASingleCell) {
  const Model model = MakeModel(GridSites(5, 0.25f, 0.1f, 1), 1, [](const Eigen::Vector3f& p) {
    return p.norm() < 0.1f ? 0 : kAir;
  });
  ExpectSoundSmoothSurfaces(model);
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects[0].cells.size(), 1u);
  // It neither vanishes nor turns inside out.
  EXPECT_GT(EnclosedVolume(Smooth(scene)), 0.5 * scene.objects[0].volume);
}

TEST(SmoothSurface, CellsThatTouchInAnEdgeOrAVertexOnly) {
  for (const float jitter : {0.f, 1e-3f}) {
    for (const Eigen::Vector3f& other : {Eigen::Vector3f(0.25f, 0.25f, 0),
                                         Eigen::Vector3f(0.25f, -0.25f, 0),
                                         Eigen::Vector3f(0.25f, 0.25f, 0.25f),
                                         Eigen::Vector3f(-0.25f, 0.25f, 0.25f),
                                         Eigen::Vector3f(0.25f, -0.25f, 0.25f),
                                         Eigen::Vector3f(0.25f, 0.25f, -0.25f)}) {
      SCOPED_TRACE(other.transpose());
      ExpectSoundSmoothSurfaces(
          MakeModel(GridSites(7, 0.25f, jitter, 1),
                    1,
                    [&](const Eigen::Vector3f& p) {
                      return p.norm() < 0.1f || (p - other).norm() < 0.1f ? 0 : kAir;
                    }),
          /*has_flat_tets=*/jitter == 0);
    }
  }
}

TEST(SmoothSurface, FewAndCoplanarSites) {
  for (const std::vector<Eigen::Vector3f>& sites :
       {std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}},
        std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
        std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}}) {
    ExpectSoundSmoothSurfaces(
        MakeModel(sites, 1, [](const Eigen::Vector3f& p) { return p.x() < 0.5f ? 0 : kAir; }),
        /*has_flat_tets=*/true);
  }
}

TEST(SmoothSurface, ATorusKeepsItsHoleAndItsVolume) {
  const Model model = Torus();
  ExpectSoundSmoothSurfaces(model);
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(EulerCharacteristic(Smooth(scene)), 0);
  EXPECT_NEAR(
      EnclosedVolume(Smooth(scene)), scene.objects[0].volume, 0.01 * scene.objects[0].volume);
}

TEST(SmoothSurface, AWallOfOneCellStaysAWall) {
  // One layer of cells, with air on both sides.
  const Model model = MakeModel(GridSites(14, 0.125f, 0.2f, 2), 1, [](const Eigen::Vector3f& p) {
    return std::abs(p.z() - 0.0625f) < 0.06f && p.head<2>().norm() < 0.6f ? 0 : kAir;
  });
  ExpectSoundSmoothSurfaces(model);
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_NEAR(
      EnclosedVolume(Smooth(scene)), scene.objects[0].volume, 0.02 * scene.objects[0].volume);
}

// How far a point is from the surface of the cube [-half, half]^3.
double DistanceToCube(const Vector3d& x, double half) {
  const Vector3d out = (x.cwiseAbs() - Vector3d::Constant(half)).cwiseMax(0);
  return out.norm() > 0 ? out.norm() : half - x.cwiseAbs().maxCoeff();
}

TEST(SmoothSurface, NoiseFallsAndTheEdgesOfACubeStay) {
  // Cells 0.1 across whose sites are off the grid by up to 0.03.
  constexpr double kHalf = 0.7, kCell = 0.1;
  const ExportableScene scene =
      MakeExportableScene(MakeModel(GridSites(20, kCell, 0.3f, 3), 1, [](const Eigen::Vector3f& p) {
        return p.cwiseAbs().maxCoeff() < kHalf ? 0 : kAir;
      }));
  const ObjectSurface cells = ExtractSurface(scene, scene.objects[0]);
  const ObjectSurface smooth = Smooth(scene);
  EXPECT_NEAR(EnclosedVolume(smooth), scene.objects[0].volume, 0.01 * scene.objects[0].volume);

  // Root mean square of the distance of the vertices from the cube.
  const auto noise = [&](const ObjectSurface& surface) {
    double sum = 0;
    for (const Vector3d& x : surface.vertices) sum += std::pow(DistanceToCube(x, kHalf), 2);
    return std::sqrt(sum / static_cast<double>(surface.vertices.size()));
  };
  EXPECT_LT(noise(smooth), 0.45 * noise(cells));
  // How far the cube's edges, as triangles of next to no width, are from the surface. If it were
  // rounded off by the size of a cell, that would be 0.41 cells.
  std::vector<Vector3d> corners;
  Triangles edges;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double u : {-kHalf, kHalf}) {
      for (const double v : {-kHalf, kHalf}) {
        const uint32_t first = static_cast<uint32_t>(corners.size());
        for (const double along : {-0.6, 0.6, 0.6 + 1e-9}) {
          Vector3d& x = corners.emplace_back();
          x[axis] = along;
          x[(axis + 1) % 3] = u;
          x[(axis + 2) % 3] = along > 0.6 ? v - 1e-6 : v;
        }
        edges.push_back({first, first + 1, first + 2});
      }
    }
  }
  EXPECT_LT(DistanceTo(corners, edges, smooth.vertices, smooth.triangles).mean, 0.3 * kCell);
}

TEST(SmoothSurface, VerticesStayBetweenTheirSites) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls());
  const ObjectInfo& object = scene.objects[0];
  const ObjectSurface surface = Smooth(scene);
  // The vertices are numbered as the edges from the object's cells to others.
  size_t v = 0;
  for (const uint32_t i : object.cells) {
    for (const uint32_t j : scene.delaunay.Neighbors(i)) {
      if (j < scene.NumSites() && scene.object_of_cell[j] == 0) continue;
      ASSERT_LT(v, surface.vertices.size());
      const Vector3d from = scene.cell_positions[i].cast<double>();
      const Vector3d edge = scene.cell_positions[j].cast<double>() - from;
      const Vector3d x = scene.world_from_normalized.Invert(surface.vertices[v]);
      const double along = (x - from).dot(edge) / edge.squaredNorm();
      EXPECT_GT(along, 0.049);
      EXPECT_LT(along, 0.951);
      // What cell i is, is what it shows.
      EXPECT_EQ(surface.vertex_confidence[v], scene.labels.confidence[i]);
      EXPECT_EQ(surface.vertex_color[v], ToColor8(scene.display_color[i]));
      ++v;
    }
  }
  EXPECT_EQ(v, surface.vertices.size());
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    double green = 0;
    float confidence = 0;
    for (const uint32_t corner : surface.triangles[f]) {
      green += surface.vertex_color[corner][1] / 3.0;
      confidence += surface.vertex_confidence[corner] / 3;
    }
    EXPECT_NEAR(surface.face_color[f][1], green, 0.51);
    EXPECT_NEAR(surface.face_confidence[f], confidence, 1e-6);
  }
}

TEST(SmoothSurface, SpikesAreCutOff) {
  const auto size = [](const ObjectSurface& surface) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& x : surface.vertices) box.extend(x);
    return box.diagonal().norm();
  };
  // Clusters of cells with nothing around them for a long way reach out to the guards. Where cells
  // draw their class by lot, the surface would intersect itself and goes back to its edges.
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    std::mt19937 random(seed);
    const ExportableScene scene = MakeExportableScene(
        MakeModel(GridSites(6, 0.01f, 0.3f, seed), 1, [&](const Eigen::Vector3f& p) {
          return p.x() > 0.015f || random() % 2 == 0 ? 0 : kAir;
        }));
    const ObjectSurface smooth = Smooth(scene);
    ExpectClosedManifold(smooth);
    EXPECT_THAT(SelfIntersections(smooth.vertices, smooth.triangles), IsEmpty());
    EXPECT_GT(size(ExtractSurface(scene, scene.objects[0])), 50);
    EXPECT_LT(size(smooth), 0.3);
  }
}

TEST(SmoothSurface, FarFromTheWorldsOriginItIsTheSame) {
  Model model = TouchingBalls();
  model.world_from_normalized = {50, {0, 0, 0}};
  const ObjectSurface at_origin = Smooth(MakeExportableScene(model));
  const Vector3d offset(5e5, 4.5e6, 250);
  model.world_from_normalized.translation = offset;
  const ObjectSurface at_utm = Smooth(MakeExportableScene(model));
  EXPECT_EQ(at_origin.triangles, at_utm.triangles);
  ASSERT_EQ(at_origin.vertices.size(), at_utm.vertices.size());
  for (size_t v = 0; v < at_origin.vertices.size(); ++v) {
    EXPECT_LT((at_utm.vertices[v] - offset - at_origin.vertices[v]).norm(), 1e-6);
  }
}

TEST(SmoothSurface, TheSameOnAnyNumberOfThreads) {
  const Model model = TouchingBalls();
  std::vector<ObjectSurface> surfaces;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    surfaces.push_back(Smooth(MakeExportableScene(model)));
  }
  for (const ObjectSurface& surface : surfaces) {
    EXPECT_EQ(surface.vertices, surfaces[0].vertices);
    EXPECT_EQ(surface.triangles, surfaces[0].triangles);
    EXPECT_EQ(surface.vertex_color, surfaces[0].vertex_color);
  }
}

}  // namespace
}  // namespace semfoam
