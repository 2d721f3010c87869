// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/vdb_grids.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <numeric>

#include <openvdb/tools/Prune.h>

namespace semfoam {
namespace {

constexpr int64_t kBlocksPerTask = 64;

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using ColorLeaf = openvdb::Vec3STree::LeafNodeType;
using Int32Leaf = openvdb::Int32Tree::LeafNodeType;

// The leaves of one block; null if the grid is not requested or the block is empty.
struct BlockLeaves {
  std::unique_ptr<FloatLeaf> density, label, confidence;
  std::unique_ptr<ColorLeaf> color;
  std::unique_ptr<Int32Leaf> label_int32;
};

// What a voxel holds.
struct VoxelValues {
  CellValues values;
  LabelId label = kNoObject;
};

// Makes voxels of samples. For one thread.
class VoxelReducer {
 public:
  VoxelReducer(const std::vector<CellValues>& values, const VoxelLabels& labels)
      : values_(values), labels_(labels) {}

  // The voxel (x, y, z) of the block; false where none of its samples is in a cell.
  bool operator()(const SampleBlock& block, int x, int y, int z, VoxelValues* voxel) {
    const int n = block.samples;
    if (n == 1) {
      const uint32_t cell = block.cells[64 * x + 8 * y + z];
      if (cell == kNoCell) return false;
      *voxel = {values_[cell], labels_.Of(cell)};
      return true;
    }
    tallies_.clear();
    float density = 0;
    for (int i = n * x; i < n * (x + 1); ++i) {
      for (int j = n * y; j < n * (y + 1); ++j) {
        const uint32_t* column = &block.cells[(static_cast<size_t>(i) * 8 * n + j) * 8 * n];
        for (int k = n * z; k < n * (z + 1); ++k) {
          if (column[k] == kNoCell) continue;
          const CellValues& values = values_[column[k]];
          density += values.density;
          Tally& tally = TallyOf(labels_.Of(column[k]));
          ++tally.samples;
          tally.color += values.color;
          tally.confidence += values.confidence;
        }
      }
    }
    if (tallies_.empty()) return false;
    const Tally& most =
        *std::min_element(tallies_.begin(), tallies_.end(), [](const Tally& a, const Tally& b) {
          return a.samples != b.samples ? a.samples > b.samples : a.label < b.label;
        });
    const float share = 1 / static_cast<float>(most.samples);
    voxel->values = {
        density / static_cast<float>(n * n * n), most.color * share, most.confidence * share};
    voxel->label = most.label;
    return true;
  }

 private:
  struct Tally {
    LabelId label = kNoObject;
    int samples = 0;
    openvdb::Vec3s color{0.f};
    float confidence = 0;
  };

  Tally& TallyOf(LabelId label) {
    for (Tally& tally : tallies_) {
      if (tally.label == label) return tally;
    }
    tallies_.push_back({label});
    return tallies_.back();
  }

  const std::vector<CellValues>& values_;
  const VoxelLabels& labels_;
  std::vector<Tally> tallies_;  // a few: of the labels in one voxel
};

template <typename Leaf>
void MakeLeaf(const SampleBlock& block, std::unique_ptr<Leaf>* leaf) {
  static_assert(Leaf::DIM == 8);
  const Eigen::Vector3i& origin = block.origin;
  *leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x(), origin.y(), origin.z()));
}

template <typename Leaf, typename Value>
void SetVoxel(openvdb::Index voxel, const Value& value, Leaf* leaf) {
  if (leaf != nullptr) leaf->setValueOn(voxel, value);
}

// Makes the wanted leaves of a block of samples. Returns how many voxels are active.
int64_t FillLeaves(const SampleBlock& samples,
                   const LabelGrids& wanted,
                   VoxelReducer* reduce,
                   BlockLeaves* leaves) {
  MakeLeaf(samples, &leaves->density);
  MakeLeaf(samples, &leaves->color);
  MakeLeaf(samples, &leaves->confidence);
  if (wanted.label) MakeLeaf(samples, &leaves->label);
  if (wanted.label_int32) MakeLeaf(samples, &leaves->label_int32);
  int64_t num_voxels = 0;
  VoxelValues voxel;
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      for (int z = 0; z < 8; ++z) {
        if (!(*reduce)(samples, x, y, z, &voxel)) continue;
        const openvdb::Index at = 64 * x + 8 * y + z;
        SetVoxel(at, voxel.values.density, leaves->density.get());
        SetVoxel(at, voxel.values.color, leaves->color.get());
        SetVoxel(at, voxel.values.confidence, leaves->confidence.get());
        SetVoxel(at, static_cast<float>(Value(voxel.label)), leaves->label.get());
        SetVoxel(at, Value(voxel.label), leaves->label_int32.get());
        ++num_voxels;
      }
    }
  }
  return num_voxels;
}

// Moves the leaves that `leaf_of` takes out of each block into a grid.
template <typename Grid, typename LeafOf>
typename Grid::Ptr GridOf(std::vector<BlockLeaves>* blocks, const LeafOf& leaf_of) {
  typename Grid::Ptr grid = Grid::create();
  for (BlockLeaves& block : *blocks) {
    auto& leaf = leaf_of(block);
    if (leaf != nullptr) grid->tree().addLeaf(leaf.release());
  }
  // Cells larger than a leaf make leaves of one value, which need no 512 copies of it.
  openvdb::tools::prune(grid->tree());
  return grid;
}

}  // namespace

VoxelGrids MakeVoxelGrids(const CellVoxelizer& voxelizer,
                          const std::vector<CellValues>& values,
                          const VoxelLabels& labels,
                          const LabelGrids& wanted,
                          const std::function<void(double)>& progress) {
  const int64_t num_blocks = voxelizer.NumBlocks();
  std::vector<BlockLeaves> blocks(num_blocks);
  std::vector<int64_t> voxels((num_blocks + kBlocksPerTask - 1) / kBlocksPerTask, 0);
  std::mutex mutex;
  int64_t done = 0;
  ParallelForBlocks(num_blocks, kBlocksPerTask, [&](int64_t begin, int64_t end) {
    SampleBlock samples;
    VoxelReducer reduce(values, labels);
    for (int64_t k = begin; k < end; ++k) {
      if (!voxelizer.Fill(k, &samples)) continue;
      voxels[begin / kBlocksPerTask] += FillLeaves(samples, wanted, &reduce, &blocks[k]);
    }
    if (progress == nullptr) return;
    const std::lock_guard<std::mutex> lock(mutex);
    done += end - begin;
    progress(static_cast<double>(done) / static_cast<double>(num_blocks));
  });

  VoxelGrids grids;
  grids.num_voxels = std::accumulate(voxels.begin(), voxels.end(), int64_t{0});
  // One grid's leaves are put together by one thread.
  ParallelForBlocks(5, 1, [&](int64_t k, int64_t) {
    switch (k) {
      case 0:
        grids.color = GridOf<openvdb::Vec3SGrid>(
            &blocks, [](auto& b) -> auto& { return b.color; });
        break;
      case 1:
        grids.density = GridOf<openvdb::FloatGrid>(
            &blocks, [](auto& b) -> auto& { return b.density; });
        break;
      case 2:
        grids.confidence = GridOf<openvdb::FloatGrid>(
            &blocks, [](auto& b) -> auto& { return b.confidence; });
        break;
      case 3:
        grids.label = GridOf<openvdb::FloatGrid>(
            &blocks, [](auto& b) -> auto& { return b.label; });
        break;
      default:
        grids.label_int32 = GridOf<openvdb::Int32Grid>(
            &blocks, [](auto& b) -> auto& { return b.label_int32; });
    }
  });
  return grids;
}

}  // namespace semfoam
