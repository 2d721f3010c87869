// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_description.h"

#include "export/scene/object_surface.h"

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// An L of three cubes of edge 1/2, from cells of edge 1/8, at UTM coordinates, in another frame.
TEST(ObjectDescription, MeasuresAreExact) {
  Model model = MakeModel(GridSites(16, 0.125f, 0, 0), 1, [](const Eigen::Vector3f& p) {
    const bool in_square = p.minCoeff() > -0.5f && p.maxCoeff() < 0.5f && p.z() < 0;
    return in_square && !(p.x() > 0 && p.y() > 0) ? 0 : kAir;
  });
  model.world_from_normalized = {4, {5e5, 4.5e6, 100}};
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects.size(), 1u);
  const ObjectInfo& object = scene.objects[0];
  EXPECT_NEAR(object.volume, 3 * 8, 1e-5);
  EXPECT_NEAR(object.area, 14 * 4, 1e-5);
  // The mean of the three cubes' middles, in units of their edges.
  const Eigen::Vector3d expected(5e5 - 1. / 3, 4.5e6 - 1. / 3, 100 - 1);
  EXPECT_LT((object.centroid - expected).norm(), 1e-5);

  ExportTransformOptions frame;
  frame.transform = "0 -1 0 5 1 0 0 0 0 0 1 7";
  frame.scale = 10;
  ExportableSceneOptions options;
  options.transform = ParseExportTransform(frame);
  const ExportableScene moved = MakeExportableScene(model, options);
  EXPECT_NEAR(moved.objects[0].area, 100 * object.area, 1e-3);
  const Eigen::Vector3d& c = object.centroid;
  const Eigen::Vector3d turned(10 * (5 - c.y()), 10 * c.x(), 10 * (c.z() + 7));
  EXPECT_LT((moved.objects[0].centroid - turned).norm(), 1e-4);
}

TEST(ObjectDescription, AgreesWithTheSurfaceAndTheCells) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls());
  for (const ObjectInfo& object : scene.objects) {
    const ObjectSurface surface = ExtractSurface(scene, object);
    double area = 0;
    for (const auto& [a, b, c] : surface.triangles) {
      area += 0.5 * (surface.vertices[b] - surface.vertices[a])
                        .cross(surface.vertices[c] - surface.vertices[a])
                        .norm();
    }
    EXPECT_NEAR(object.area, area, 1e-12 * area);
    // Cells are small: the volume-weighted mean of their sites is near, and not the same.
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const uint32_t cell : object.cells) {
      mean += scene.volume[cell] / object.volume * scene.cell_positions[cell].cast<double>();
    }
    const double off = (object.centroid - mean).norm();
    EXPECT_LT(off, 0.05);
    EXPECT_GT(off, 1e-6);
  }
}

}  // namespace
}  // namespace semfoam
