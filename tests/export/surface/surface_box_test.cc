// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_box.h"

#include "export/scene/object_surface.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_geometry.h"

#include <cmath>

#include "tests/export/surface/surface_checks.h"
#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// A floor of small cells, 2 by 2, under air; below it and around it a few large cells of the same
// class, which no photo shows.
Model Floor() {
  std::vector<Eigen::Vector3f> sites = GridSites(20, 0.1f, 0.2f, 1);
  const size_t num_small = sites.size();
  for (const Eigen::Vector3f& site : GridSites(6, 4.f, 0.2f, 2)) {
    if (site.cwiseAbs().maxCoeff() > 1.5f) sites.push_back(site);
  }
  const auto is_floor = [](const Eigen::Vector3f& p) {
    return p.z() < 0 && p.z() > (p.cwiseAbs().maxCoeff() > 1.5f ? -8.f : -0.3f);
  };
  Model model =
      MakeModel(sites, 1, [&](const Eigen::Vector3f& p) { return is_floor(p) ? 0 : kAir; });
  model.statistics.contribution.assign(sites.size(), 0.f);
  std::fill_n(model.statistics.contribution.begin(), num_small, 1.f);
  return model;
}

TEST(SurfaceBox, CutsWhatReachesFarBeyondWhatPhotosShow) {
  const ExportableScene scene = MakeExportableScene(Floor());
  const ObjectInfo& floor = scene.objects.at(0);
  const Eigen::AlignedBox3d box = SurfaceBox(scene, floor.cells);
  ASSERT_TRUE(box.min().allFinite());
  EXPECT_LT((box.max() - box.min()).head<2>().maxCoeff(), 2.6);
  EXPECT_GT((box.max() - box.min()).head<2>().minCoeff(), 1.9);
  EXPECT_GT(box.min().z(), -0.5) << "not the large cells below";
  EXPECT_EQ(box.max().z(), INFINITY) << "nothing is above";

  ObjectInfo part = floor;
  part.cells = CellsInBox(scene, floor.cells, box);
  EXPECT_LT(part.cells.size(), floor.cells.size());
  const ObjectSurface surface = ExtractSmoothSurface(scene, part, ExtractSurface(scene, part), box);
  ExpectClosedManifold(surface);
  EXPECT_THAT(SelfIntersections(surface.vertices, surface.triangles), ::testing::IsEmpty());
  size_t on_rim = 0;
  for (const Eigen::Vector3d& vertex : surface.vertices) {
    const Eigen::Vector3d x = scene.world_from_normalized.Invert(vertex);
    EXPECT_TRUE((x.array() >= box.min().array() - 1e-9).all() &&
                (x.array() <= box.max().array() + 1e-9).all())
        << x.transpose();
    on_rim += std::abs(x.x() - box.min().x()) < 1e-9;
  }
  EXPECT_GT(on_rim, 10u) << "the rim is a plane";
}

TEST(SurfaceBox, ThingsThatEndByThemselvesStayWhole) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls());
  for (const ObjectInfo& object : scene.objects) {
    const Eigen::AlignedBox3d box = SurfaceBox(scene, object.cells);
    EXPECT_FALSE(box.min().allFinite() || box.max().allFinite());
    EXPECT_EQ(CellsInBox(scene, object.cells, box), object.cells);
  }
}

TEST(SurfaceBox, WithoutPhotographedCellsThereIsNoLimit) {
  Model model = TouchingBalls();
  ExportableScene scene = MakeExportableScene(model);
  scene.photographed.assign(scene.NumSites(), 0);
  const Eigen::AlignedBox3d box = SurfaceBox(scene, scene.objects[0].cells);
  EXPECT_EQ(box.min(), WholeSpace().min());
  EXPECT_EQ(box.max(), WholeSpace().max());
}

}  // namespace
}  // namespace semfoam
