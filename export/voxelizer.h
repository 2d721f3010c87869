// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// A regular grid of voxel centres in the normalised frame: voxel (i, j, k) has its centre at
// origin + voxel_size * (i, j, k). Indices may be negative.
struct VoxelLattice {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double voxel_size = 1;  // > 0
};

// 8^3 voxels, the size and the layout of an OpenVDB leaf: the cell of voxel origin + (x, y, z) is
// cells[64 x + 8 y + z], or kNoCell where the voxel's centre lies in none of the wanted cells.
struct VoxelBlock {
  Eigen::Vector3i origin;  // multiples of 8
  std::array<uint32_t, 512> cells;
};

// A box around the cell (its corners' for a cell that is bounded, else everything), cut to `box`.
// Empty where they do not meet. Normalised frame.
Eigen::AlignedBox3d CellBox(const ExportableScene& scene,
                            uint32_t cell,
                            const Eigen::AlignedBox3d& box);

// Finds the voxels whose centres lie in the cells listed in `cells` and within `box` (normalised
// frame). Each such voxel gets the cell of the nearest site (a voxel exactly on the face between
// two listed cells: the lower index). Blocks without any are left out; the others come in a fixed
// order, the same on any number of threads. Work and memory grow with the voxels found, not with
// the box: each cell's polyhedron is bisected down to the blocks that it touches, so that a long
// thin cell costs what it covers. CHECKs that the box has at most 2^23 voxels along each axis.
std::vector<VoxelBlock> VoxelizeCells(const ExportableScene& scene,
                                      const std::vector<uint32_t>& cells,
                                      const VoxelLattice& lattice,
                                      const Eigen::AlignedBox3d& box);

}  // namespace semfoam
