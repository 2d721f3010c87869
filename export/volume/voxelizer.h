// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

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

// One number for a block, the three of its origin divided by 8, each at least -2^20 and less than
// 2^20: by it the blocks are ordered, along x, then y, then z.
uint64_t PackBlock(const Eigen::Vector3i& block);
Eigen::Vector3i UnpackBlock(uint64_t key);

// The samples of 8^3 voxels, samples^3 in each of them, spread evenly over it (one: its centre):
// the cell of sample (x, y, z), counted through the whole block, is cells[(x e + y) e + z] with
// e = 8 samples.
struct SampleBlock {
  Eigen::Vector3i origin;  // of the first voxel, multiples of 8
  int samples = 1;
  std::vector<uint32_t> cells;
  std::vector<double> distances;  // squared, of the samples to their cells' sites
};

// A box around the cell (its corners' for a cell that is bounded, else everything), cut to `box`.
// Empty where they do not meet. Normalised frame.
Eigen::AlignedBox3d CellBox(const ExportableScene& scene,
                            uint32_t cell,
                            const Eigen::AlignedBox3d& box);

// Inclusive ranges of indices along the three axes.
struct IndexBox {
  Eigen::Vector3i low = Eigen::Vector3i::Zero();
  Eigen::Vector3i high = Eigen::Vector3i::Constant(-1);
  bool IsEmpty() const { return (low.array() > high.array()).any(); }
};

// Finds the samples that lie in the cells listed in `cells` (ascending), in the voxels whose
// centres lie within `box` (normalised frame), block by block, so that whoever fills voxels needs
// to hold no more than one block. Each sample gets the cell of the nearest site (one exactly on the
// face between two listed cells: the lower index). Work and memory grow with the samples found, not
// with the box: each cell's polyhedron is bisected down to the blocks that it touches, so that a
// long thin cell costs what it covers. The blocks come in a fixed order, the same on any number of
// threads.
//
// Keeps references to `scene` and `cells`. CHECKs that the box reaches no farther than 2^23 voxels
// from the lattice's origin.
class CellVoxelizer {
 public:
  CellVoxelizer(const ExportableScene& scene,
                const std::vector<uint32_t>& cells,
                const VoxelLattice& lattice,
                const Eigen::AlignedBox3d& box,
                int samples = 1);

  // The blocks that some cell touches; a few of them may turn out to hold no sample.
  int64_t NumBlocks() const { return starts_.empty() ? 0 : std::ssize(starts_) - 1; }

  // Fills `block`, whose storage can serve again; false where it holds no sample of any cell.
  // Thread-safe.
  bool Fill(int64_t index, SampleBlock* block) const;

 private:
  struct Touch {
    uint64_t block;
    uint32_t cell;  // index into cells_
  };

  int BlockEdge() const { return 8 * samples_; }
  // Fills boxes_ and touches_: which blocks each cell may touch, as far as it lies in `box`
  // (normalised frame) and its samples in `limits`.
  void FindTouches(const Eigen::AlignedBox3d& box, const IndexBox& limits);

  const ExportableScene& scene_;
  const std::vector<uint32_t>& cells_;
  const int samples_;
  const VoxelLattice lattice_;  // of the samples
  double reach_ = 0;
  std::vector<IndexBox> boxes_;  // of cells_, in samples
  std::vector<Touch> touches_;   // by block, then by cell
  std::vector<size_t> starts_;   // of the blocks in touches_, and its end
};

// All blocks of the voxels whose centres lie in the cells. Blocks without any are left out.
std::vector<VoxelBlock> VoxelizeCells(const ExportableScene& scene,
                                      const std::vector<uint32_t>& cells,
                                      const VoxelLattice& lattice,
                                      const Eigen::AlignedBox3d& box);

}  // namespace semfoam
