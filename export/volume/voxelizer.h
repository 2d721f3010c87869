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
  // > 0.
  double voxel_size = 1;
};

// A block of 8^3 voxels, the size and the layout of an OpenVDB leaf: the cell of voxel origin + (x,
// y, z) is cells[64 x + 8 y + z], or kNoCell where the voxel's centre lies in none of the listed
// cells.
struct VoxelBlock {
  // Multiples of 8.
  Eigen::Vector3i origin;
  std::array<uint32_t, 512> cells;
};

// Packs the coordinates of a block (its origin divided by 8), each at least -2^20 and less than
// 2^20, into one number. Blocks are ordered by this number: by x, then y, then z.
uint64_t PackBlock(const Eigen::Vector3i& block);
Eigen::Vector3i UnpackBlock(uint64_t key);

// The samples of a block of 8^3 voxels, samples^3 in each of them, evenly spaced (a single one is
// the centre): the cell of sample (x, y, z), counted through the whole block, is cells[(x e + y) e
// + z] with e = 8 samples.
struct SampleBlock {
  Eigen::Vector3i origin;  // of the first voxel, multiples of 8
  int samples = 1;
  std::vector<uint32_t> cells;
  // Squared distances of the samples to their cells' sites.
  std::vector<double> distances;
};

// Returns a box around a cell (the box of its corners if the cell is bounded, else everything),
// clipped to `box`; empty where they do not intersect. Normalised frame.
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
// centres lie within `box` (normalised frame), block by block, so that callers need to hold only
// one block at a time. Each sample gets the cell of the nearest site (one exactly on the face
// between two listed cells: the lower index). Work and memory grow with the samples found, not with
// the box: each cell's polyhedron is bisected down to the blocks that it touches, so that the work
// for a long thin cell follows its volume. The order of the blocks does not depend on the number of
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

  // Returns the number of blocks that any cell touches; a few of them may hold no sample.
  int64_t NumBlocks() const { return starts_.empty() ? 0 : std::ssize(starts_) - 1; }

  // Fills `block`, reusing its memory. Returns false where it holds no sample of any cell.
  // Thread-safe.
  bool Fill(int64_t index, SampleBlock* block) const;

 private:
  struct Touch {
    uint64_t block;
    // Index into cells_.
    uint32_t cell;
  };

  int BlockEdge() const { return 8 * samples_; }
  // Fills boxes_ and touches_ with the blocks that each cell may touch within `box` (normalised
  // frame) and `limits` (samples).
  void FindTouches(const Eigen::AlignedBox3d& box, const IndexBox& limits);

  const ExportableScene& scene_;
  const std::vector<uint32_t>& cells_;
  const int samples_;
  // Lattice of the samples.
  const VoxelLattice lattice_;
  double reach_ = 0;
  // Boxes of cells_, in samples.
  std::vector<IndexBox> boxes_;
  // Ordered by block, then by cell.
  std::vector<Touch> touches_;
  // Begin of each block in touches_, and the end of the last.
  std::vector<size_t> starts_;
};

// Returns all blocks of the voxels whose centres lie in the cells, without empty blocks.
std::vector<VoxelBlock> VoxelizeCells(const ExportableScene& scene,
                                      const std::vector<uint32_t>& cells,
                                      const VoxelLattice& lattice,
                                      const Eigen::AlignedBox3d& box);

}  // namespace semfoam
