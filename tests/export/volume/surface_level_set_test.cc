// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_export.h"
#include "export/scene/object_surface.h"
#include "export/volume/vdb_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

double DistanceToSegment(const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b,
                         const Eigen::Vector3d& x) {
  const double length = (b - a).squaredNorm();
  const double t = length > 0 ? std::clamp((x - a).dot(b - a) / length, 0.0, 1.0) : 0;
  return (a + t * (b - a) - x).norm();
}

double DistanceToTriangle(const std::array<Eigen::Vector3d, 3>& corners, const Eigen::Vector3d& x) {
  const auto& [a, b, c] = corners;
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  bool above = normal.norm() > 1e-12;
  double nearest = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d& from = corners[k];
    const Eigen::Vector3d& to = corners[(k + 1) % 3];
    nearest = std::min(nearest, DistanceToSegment(from, to, x));
    above &= (to - from).cross(x - from).dot(normal) >= 0;
  }
  return above ? std::abs(normal.normalized().dot(x - a)) : nearest;
}

// Every voxel of `box` that the level set covers, and some around: its sign against the cells that
// hold the centres, its distance, in voxels, against a search through all triangles.
void ExpectLevelSet(const ExportableScene& scene,
                    const ObjectInfo& object,
                    const VoxelLattice& lattice,
                    const Eigen::AlignedBox3d& box) {
  constexpr double kVoxelSize = 0.125;
  const openvdb::FloatGrid::Ptr grid = MakeSurfaceLevelSet(scene, object, lattice, box, kVoxelSize);
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_FLOAT_EQ(grid->background(), static_cast<float>(3 * kVoxelSize));

  std::map<std::array<int, 3>, bool> inside;
  for (const VoxelBlock& block : VoxelizeCells(scene, object.cells, lattice, box)) {
    for (int k = 0; k < 512; ++k) {
      if (block.cells[k] == kNoCell) continue;
      const Eigen::Vector3i at = block.origin + Eigen::Vector3i(k >> 6, k >> 3 & 7, k & 7);
      inside[{at.x(), at.y(), at.z()}] = true;
    }
  }
  ASSERT_GT(inside.size(), 100u);
  const ObjectSurface surface = ExtractSurface(scene, object);
  const auto bounds = grid->evalActiveVoxelBoundingBox();
  ASSERT_FALSE(bounds.empty());
  size_t negative = 0, band = 0;
  for (auto ijk = bounds.begin(); ijk != bounds.end(); ++ijk) {
    const openvdb::Coord at = *ijk;
    const float value = grid->tree().getValue(at);
    const bool is_inside = inside.count({at.x(), at.y(), at.z()}) != 0;
    EXPECT_EQ(std::signbit(value), is_inside) << at;
    negative += is_inside;
    const Eigen::Vector3d center =
        lattice.origin + lattice.voxel_size * Eigen::Vector3d(at.x(), at.y(), at.z());
    double nearest = INFINITY;
    for (const auto& triangle : surface.triangles) {
      std::array<Eigen::Vector3d, 3> corners;
      for (int k = 0; k < 3; ++k) {
        corners[k] = scene.voronoi_vertices[surface.vertex_tet[triangle[k]]];
      }
      nearest = std::min(nearest, DistanceToTriangle(corners, center));
    }
    // Out of the box there is no object; and within, the cut is surface, too.
    if (!box.contains(center)) continue;
    const double to_cut = (center - box.min()).cwiseMin(box.max() - center).minCoeff();
    if (is_inside) nearest = std::min(nearest, to_cut);
    nearest /= lattice.voxel_size;
    if (nearest < 3 - 1e-6) {
      EXPECT_TRUE(grid->tree().isValueOn(at)) << at << " " << nearest;
      EXPECT_NEAR(std::abs(value) / kVoxelSize, nearest, 1e-5) << at;
      ++band;
    } else if (nearest > 3 + 1e-6) {
      EXPECT_FALSE(grid->tree().isValueOn(at)) << at << " " << nearest;
      EXPECT_EQ(std::abs(value), grid->background()) << at;
    }
  }
  EXPECT_EQ(negative, inside.size());
  EXPECT_GT(band, 500u);
}

class SurfaceLevelSet : public testing::Test {
 protected:
  static VoxelLattice Lattice(double voxel) { return {{0.0123, -0.0321, 0.0213}, voxel}; }
  static Eigen::AlignedBox3d Cube(double half) {
    return {Eigen::Vector3d::Constant(-half), Eigen::Vector3d::Constant(half)};
  }
};

TEST_F(SurfaceLevelSet, IsTheDistanceToTheSurfaceWithTheSignOfTheCells) {
  Model model = TouchingBalls(800);
  model.world_from_normalized = {2.5, {5e5, 4.5e6, 250}};
  const ExportableScene scene = MakeExportableScene(model);
  for (const ObjectInfo& object : scene.objects) {
    ExpectLevelSet(scene, object, Lattice(0.05), Cube(1.5));
  }
}

TEST_F(SurfaceLevelSet, TrianglesWithoutAreaAreFine) {
  const ExportableScene scene =
      MakeExportableScene(MakeModel(GridSites(6, 0.25f, 0, 0), 1, [](const Eigen::Vector3f& p) {
        return p.norm() < 0.6f ? 0 : kAir;
      }));
  ExpectLevelSet(scene, scene.objects[0], Lattice(0.07), Cube(1.2));
}

TEST_F(SurfaceLevelSet, IsClosedWhereTheBoxCutsTheObject) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(800));
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.4, -1, -1), Eigen::Vector3d(1, 0.1, 0.15));
  ExpectLevelSet(scene, scene.objects[0], Lattice(0.04), box);
}

// An object on the rim of a wide open space: its cells reach 50 times as far as its sites.
TEST_F(SurfaceLevelSet, SpikesCostWhatIsInTheBox) {
  const ExportableScene scene = MakeExportableScene(
      MakeModel(RandomSites(600, 3), 1, [](const Eigen::Vector3f&) { return 0; }));
  const ObjectInfo& object = scene.objects[0];
  ASSERT_GT(object.bounding_box.sizes().maxCoeff(), 50);
  const VoxelLattice lattice = Lattice(0.05);
  const auto grid = MakeSurfaceLevelSet(scene, object, lattice, Cube(1.1), 0.05);
  // The box's own surface, six sides of 44 x 44 voxels and the band about them, is all there is.
  EXPECT_GT(grid->activeVoxelCount(), 6u * 44 * 44 * 5);
  EXPECT_LT(grid->activeVoxelCount(), 6u * 50 * 50 * 6);
  const auto bounds = grid->evalActiveVoxelBoundingBox();
  EXPECT_LE(bounds.dim().x(), 52);
  EXPECT_LT(grid->memUsage(), 4'000'000u);
  EXPECT_LT(grid->tree().getValue(openvdb::Coord(0)), 0);
}

TEST_F(SurfaceLevelSet, NothingInTheBoxIsAnEmptyLevelSet) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(300));
  for (const Eigen::AlignedBox3d& box :
       {Eigen::AlignedBox3d(),
        Eigen::AlignedBox3d(Eigen::Vector3d(5, 5, 5), Eigen::Vector3d(6, 6, 6))}) {
    const auto grid = MakeSurfaceLevelSet(scene, scene.objects[0], Lattice(0.05), box, 0.05);
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_EQ(grid->activeVoxelCount(), 0u);
    EXPECT_GT(grid->tree().getValue(openvdb::Coord(0)), 0);
  }
}

}  // namespace
}  // namespace semfoam
