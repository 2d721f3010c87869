// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/voxelizer.h"

#include "foam/util/parallel.h"

#include <map>
#include <numeric>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Index = std::array<int, 3>;

std::map<Index, uint32_t> Voxels(const std::vector<VoxelBlock>& blocks) {
  std::map<Index, uint32_t> voxels;
  for (const VoxelBlock& block : blocks) {
    bool any = false;
    for (int k = 0; k < 512; ++k) {
      if (block.cells[k] == kNoCell) continue;
      any = true;
      const Eigen::Vector3i at = block.origin + Eigen::Vector3i(k >> 6, k >> 3 & 7, k & 7);
      EXPECT_TRUE(voxels.emplace(Index{at.x(), at.y(), at.z()}, block.cells[k]).second)
          << "a block comes twice";
    }
    EXPECT_TRUE(any) << "an empty block";
    for (int a = 0; a < 3; ++a) EXPECT_EQ(block.origin[a] % 8, 0);
  }
  return voxels;
}

double Distance(const ExportableScene& scene, uint32_t cell, const Eigen::Vector3d& x) {
  return (scene.cell_positions[cell].cast<double>() - x).norm();
}

// Every voxel of the box against a search through all sites.
void ExpectNearestSites(const ExportableScene& scene,
                        const std::vector<uint32_t>& cells,
                        const VoxelLattice& lattice,
                        const Eigen::AlignedBox3d& box) {
  const auto voxels = Voxels(VoxelizeCells(scene, cells, lattice, box));
  std::vector<uint8_t> wanted(scene.delaunay.num_cells, 0);
  for (const uint32_t cell : cells) wanted[cell] = 1;
  size_t expected = 0, ties = 0;
  const double v = lattice.voxel_size;
  const Eigen::Vector3i low =
      ((box.min() - lattice.origin) / v).array().ceil().matrix().cast<int>();
  const Eigen::Vector3i high =
      ((box.max() - lattice.origin) / v).array().floor().matrix().cast<int>();
  for (int i = low.x(); i <= high.x(); ++i) {
    for (int j = low.y(); j <= high.y(); ++j) {
      for (int k = low.z(); k <= high.z(); ++k) {
        const Eigen::Vector3d x = lattice.origin + v * Eigen::Vector3d(i, j, k);
        uint32_t nearest = 0;
        for (uint32_t cell = 1; cell < scene.delaunay.num_cells; ++cell) {
          if (Distance(scene, cell, x) < Distance(scene, nearest, x)) nearest = cell;
        }
        const auto found = voxels.find({i, j, k});
        if (found == voxels.end()) {
          if (!wanted[nearest]) continue;
          ADD_FAILURE() << "voxel " << i << " " << j << " " << k << " is missing";
          continue;
        }
        EXPECT_TRUE(wanted[found->second]);
        // Exactly between two sites either is right.
        const double gap = Distance(scene, found->second, x) - Distance(scene, nearest, x);
        EXPECT_LE(gap, 1e-12);
        ties += found->second != nearest;
        ++expected;
      }
    }
  }
  EXPECT_EQ(voxels.size(), expected) << "voxels outside of the box";
  EXPECT_GT(expected, 0u);
  EXPECT_LE(ties, expected / 2);
}

std::vector<uint32_t> AllCells(const ExportableScene& scene) {
  std::vector<uint32_t> cells(scene.NumSites());
  std::iota(cells.begin(), cells.end(), 0u);
  return cells;
}

const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-0.9, -0.8, -0.7), Eigen::Vector3d(0.7, 0.8, 0.95));

TEST(Voxelizer, FindsTheNearestSiteOfEveryVoxel) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(400));
  const VoxelLattice lattice{{-0.9 + 0.03, -0.77, -0.67}, 0.06};
  ExpectNearestSites(scene, AllCells(scene), lattice, kBox);
  ExpectNearestSites(scene, scene.objects[0].cells, lattice, kBox);
}

TEST(Voxelizer, NegativeIndicesAndLatticesOffTheBoxAreFine) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(200));
  ExpectNearestSites(scene, AllCells(scene), {{3.21, 2.5, -4}, 0.07}, kBox);
}

TEST(Voxelizer, UnboundedCellsFillTheBoxWithoutHoles) {
  // A few sites far apart: every cell is bounded by guards alone, many corners are cut.
  const ExportableScene scene = MakeExportableScene(
      MakeModel({{0, 0, 0}, {0.1f, 0, 0}, {0, 25, 0}}, 1, [](const auto&) { return 0; }));
  const Eigen::AlignedBox3d wide(Eigen::Vector3d::Constant(-28), Eigen::Vector3d::Constant(28));
  ExpectNearestSites(scene, AllCells(scene), {{-28, -28, -28}, 1.1}, wide);
}

TEST(Voxelizer, CentresOnFacesBelongToOneOfTheCells) {
  // An exact grid of sites, and voxel centres on its faces, edges and corners.
  const ExportableScene scene =
      MakeExportableScene(MakeModel(GridSites(4, 0.25f, 0, 0), 1, [](const auto&) { return 0; }));
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Constant(-0.5), Eigen::Vector3d::Constant(0.5));
  const auto voxels =
      Voxels(VoxelizeCells(scene, AllCells(scene), {Eigen::Vector3d::Constant(-0.5), 0.125}, box));
  EXPECT_EQ(voxels.size(), 9u * 9 * 9);
  for (const auto& [at, cell] : voxels) {
    const Eigen::Vector3d x =
        Eigen::Vector3d::Constant(-0.5) + 0.125 * Eigen::Vector3d(at[0], at[1], at[2]);
    for (uint32_t other = 0; other < scene.NumSites(); ++other) {
      const double d = Distance(scene, cell, x), e = Distance(scene, other, x);
      EXPECT_TRUE(d < e || (d == e && cell <= other)) << "the lowest index wins";
    }
  }
}

TEST(Voxelizer, TheThreadsDoNotMatter) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(3000));
  const VoxelLattice lattice{{-0.9, -0.8, -0.7}, 0.02};
  const auto voxelize = [&](int threads) {
    const ThreadLimit limit(threads);
    return VoxelizeCells(scene, AllCells(scene), lattice, kBox);
  };
  const auto alone = voxelize(1), together = voxelize(5);
  ASSERT_EQ(alone.size(), together.size());
  for (size_t k = 0; k < alone.size(); ++k) {
    EXPECT_EQ(alone[k].origin, together[k].origin);
    EXPECT_EQ(alone[k].cells, together[k].cells);
  }
}

TEST(Voxelizer, AThinCellInAHugeBoxCostsOnlyItself) {
  // A needle of a cell, along the diagonal of a lattice of 2^48 voxels and some 8 voxels wide.
  const Eigen::Vector3f u = Eigen::Vector3f(1, -1, 0).normalized();
  const Eigen::Vector3f v = Eigen::Vector3f(1, 1, -2).normalized();
  std::vector<Eigen::Vector3f> sites = {{0, 0, 0}};
  for (int k = 0; k < 12; ++k) {
    const float angle = 0.5236f * static_cast<float>(k);
    sites.push_back(2.5e-4f * (std::cos(angle) * u + std::sin(angle) * v));
  }
  const ExportableScene scene =
      MakeExportableScene(MakeModel(sites, 1, [](const auto&) { return kAir; }));
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1));
  const auto blocks = VoxelizeCells(scene, {0}, {{-1, -1, -1}, 2.0 / (1 << 16)}, box);
  EXPECT_GT(blocks.size(), (1u << 16) / 8);
  EXPECT_LT(blocks.size(), 20u * (1 << 16) / 8);
}

TEST(Voxelizer, NothingToDoIsFine) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(100));
  EXPECT_TRUE(VoxelizeCells(scene, {}, {}, kBox).empty());
  EXPECT_TRUE(VoxelizeCells(scene, AllCells(scene), {}, Eigen::AlignedBox3d()).empty());
  // Voxels larger than the box, none of whose centres lies in it.
  EXPECT_TRUE(VoxelizeCells(scene, AllCells(scene), {{50, 50, 50}, 100}, kBox).empty());
}

}  // namespace
}  // namespace semfoam
