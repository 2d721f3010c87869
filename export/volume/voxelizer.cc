// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/voxelizer.h"

#include "foam/geometry/guard_sites.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int64_t kCellsPerTask = 256;
constexpr int64_t kBlocksPerTask = 64;

// The half-space of one neighbour: x is nearer to the cell's site p than to the neighbour's exactly
// if normal . (x - p) <= offset. The offset is a touch too large: a centre on a face, or beside it
// by less than rounding, belongs to both cells here, and the comparison of distances decides.
struct HalfSpace {
  Eigen::Vector3d normal;
  double offset;
};

constexpr int kBlockBits = 21;
constexpr int kBlockBias = 1 << (kBlockBits - 1);

int FloorDivide(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

// Returns the lattice of the samples: samples^3 in every voxel, spread evenly over it.
VoxelLattice SampleLattice(const VoxelLattice& lattice, int samples) {
  const double step = lattice.voxel_size / samples;
  return {lattice.origin - Eigen::Vector3d::Constant(0.5 * (lattice.voxel_size - step)), step};
}

// Returns the samples that lie in `box`.
IndexBox SamplesIn(const Eigen::AlignedBox3d& box, const VoxelLattice& lattice, int block_edge) {
  const int64_t max_index = int64_t{kBlockBias} * block_edge;
  IndexBox result;
  for (int a = 0; a < 3; ++a) {
    const double low = std::ceil((box.min()[a] - lattice.origin[a]) / lattice.voxel_size - 1e-9);
    const double high = std::floor((box.max()[a] - lattice.origin[a]) / lattice.voxel_size + 1e-9);
    CHECK_GE(low, -max_index);
    CHECK_LT(high, max_index);
    result.low[a] = static_cast<int>(low);
    result.high[a] = static_cast<int>(high);
  }
  return result;
}

// The blocks, of block_edge^3 samples, that hold samples of the range.
IndexBox BlocksOf(const IndexBox& samples, int block_edge) {
  IndexBox blocks = samples;
  for (int a = 0; a < 3; ++a) {
    blocks.low[a] = FloorDivide(blocks.low[a], block_edge);
    blocks.high[a] = FloorDivide(blocks.high[a], block_edge);
  }
  return blocks;
}

void ListHalfSpaces(const ExportableScene& scene,
                    uint32_t cell,
                    double reach,
                    std::vector<HalfSpace>* half_spaces) {
  half_spaces->clear();
  const Eigen::Vector3d site = scene.cell_positions[cell].cast<double>();
  for (const uint32_t neighbor : scene.delaunay.Neighbors(cell)) {
    const Eigen::Vector3d normal = scene.cell_positions[neighbor].cast<double>() - site;
    const double offset = 0.5 * normal.squaredNorm();
    half_spaces->push_back({normal, offset * (1 + 1e-9) + 1e-14 * normal.norm() * reach});
  }
}

// Bisects a range of blocks down to those that the cell touches. Half-spaces that contain the whole
// range are dropped on the way down; the live ones are half_spaces[0, num_live) of this level.
class BlockSearch {
 public:
  BlockSearch(const VoxelLattice& lattice, int block_edge) : lattice_(lattice), edge_(block_edge) {}

  // Calls touch(key of the block).
  template <typename Touch>
  void Run(const Eigen::Vector3d& site,
           const std::vector<HalfSpace>& half_spaces,
           const IndexBox& blocks,
           const Touch& touch) {
    site_ = site;
    Visit(blocks, half_spaces, 0, touch);
  }

 private:
  template <typename Touch>
  void Visit(const IndexBox& blocks,
             const std::vector<HalfSpace>& half_spaces,
             size_t depth,
             const Touch& touch) {
    const Eigen::Vector3d low =
        lattice_.origin + lattice_.voxel_size * (edge_ * blocks.low).cast<double>() - site_;
    const Eigen::Vector3d high =
        lattice_.origin +
        lattice_.voxel_size *
            (edge_ * blocks.high + Eigen::Vector3i::Constant(edge_ - 1)).cast<double>() -
        site_;
    const Eigen::Vector3d center = 0.5 * (low + high);
    const Eigen::Vector3d half = 0.5 * (high - low);
    if (levels_.size() <= depth) levels_.resize(depth + 1);
    std::vector<HalfSpace> live = std::move(levels_[depth]);
    live.clear();
    bool outside = false;
    for (const HalfSpace& h : half_spaces) {
      const double at_center = h.normal.dot(center);
      const double swing = h.normal.cwiseAbs().dot(half);
      outside = at_center - swing > h.offset;
      if (outside) break;
      if (at_center + swing > h.offset) live.push_back(h);
    }
    if (!outside) {
      int axis = 0;
      const int length = (blocks.high - blocks.low).maxCoeff(&axis);
      if (length == 0) {
        touch(PackBlock(blocks.low));
      } else {
        IndexBox part = blocks;
        part.high[axis] = blocks.low[axis] + length / 2;
        Visit(part, live, depth + 1, touch);
        part = blocks;
        part.low[axis] = blocks.low[axis] + length / 2 + 1;
        Visit(part, live, depth + 1, touch);
      }
    }
    levels_[depth] = std::move(live);
  }

  const VoxelLattice& lattice_;
  const int edge_;
  Eigen::Vector3d site_ = Eigen::Vector3d::Zero();
  std::vector<std::vector<HalfSpace>> levels_;  // storage of `live`, kept between cells
};

// A half-space seen along the columns of a block: sample (x, y, z) lies in it where z is below
// (above, for the other sign of the normal's z) `at + by_x x + by_y y`; where the normal has no z,
// where that is not negative.
struct ColumnBound {
  double at, by_x, by_y;
  double operator()(double x, double y) const { return at + by_x * x + by_y * y; }
};

// Cuts columns of samples to a cell.
class ColumnCutter {
 public:
  // `corner` is the block's first sample, relative to the site.
  void Set(const std::vector<HalfSpace>& half_spaces, const Eigen::Vector3d& corner, double step) {
    above_.clear();
    below_.clear();
    beside_.clear();
    for (const HalfSpace& h : half_spaces) {
      const double room = h.offset - h.normal.dot(corner);
      const double slope = h.normal.z() * step;
      const double scale = slope == 0 ? 1 : 1 / slope;
      const ColumnBound bound = {
          room * scale, -h.normal.x() * step * scale, -h.normal.y() * step * scale};
      (slope > 0 ? above_ : slope < 0 ? below_ : beside_).push_back(bound);
    }
  }

  // Shrinks z_low..z_high, the samples of the column (x, y), to those in the cell.
  void Cut(int x, int y, int* z_low, int* z_high) const {
    double low = *z_low;
    double high = *z_high;
    for (const ColumnBound& bound : above_) high = std::min(high, bound(x, y));
    for (const ColumnBound& bound : below_) low = std::max(low, bound(x, y));
    for (const ColumnBound& bound : beside_) {
      if (bound(x, y) < 0) high = low - 1;
    }
    if (!(low <= high)) {
      *z_high = *z_low - 1;
      return;
    }
    *z_low = static_cast<int>(std::ceil(low));
    *z_high = static_cast<int>(std::floor(high));
  }

 private:
  std::vector<ColumnBound> above_, below_, beside_;
};

}  // namespace

uint64_t PackBlock(const Eigen::Vector3i& block) {
  uint64_t key = 0;
  for (int a = 0; a < 3; ++a) {
    key = key << kBlockBits | static_cast<uint64_t>(block[a] + kBlockBias);
  }
  return key;
}

Eigen::Vector3i UnpackBlock(uint64_t key) {
  constexpr uint64_t kMask = (uint64_t{1} << kBlockBits) - 1;
  return {static_cast<int>(key >> 2 * kBlockBits & kMask) - kBlockBias,
          static_cast<int>(key >> kBlockBits & kMask) - kBlockBias,
          static_cast<int>(key & kMask) - kBlockBias};
}

Eigen::AlignedBox3d CellBox(const ExportableScene& scene,
                            uint32_t cell,
                            const Eigen::AlignedBox3d& box) {
  Eigen::AlignedBox3d result;
  for (const uint32_t tet : scene.tets_of_cells.Of(cell)) {
    const Eigen::Vector3d& corner = scene.voronoi_vertices[tet];
    // A corner that was cut to the outer sphere (VoronoiVertices) bounds nothing.
    if (corner.norm() > 1.99 * kGuardRadius) return box;
    result.extend(corner);
  }
  return result.intersection(box);
}

CellVoxelizer::CellVoxelizer(const ExportableScene& scene,
                             const std::vector<uint32_t>& cells,
                             const VoxelLattice& lattice,
                             const Eigen::AlignedBox3d& box,
                             int samples)
    : scene_(scene), cells_(cells), samples_(samples), lattice_(SampleLattice(lattice, samples)) {
  CHECK_GT(lattice.voxel_size, 0);
  CHECK_GE(samples, 1);
  CHECK(std::is_sorted(cells.begin(), cells.end()));
  if (box.isEmpty()) return;
  const IndexBox voxels = SamplesIn(box, lattice, 8);
  if (voxels.IsEmpty()) return;
  // All samples of the voxels whose centres lie in the box, and a box around them.
  const IndexBox limits = {samples * voxels.low,
                           samples * voxels.high + Eigen::Vector3i::Constant(samples - 1)};
  const Eigen::Vector3d margin =
      Eigen::Vector3d::Constant(0.5 * (lattice.voxel_size - lattice_.voxel_size));
  const Eigen::AlignedBox3d wide(box.min() - margin, box.max() + margin);
  reach_ = wide.diagonal().norm() + kFarRadius;
  FindTouches(wide, limits);
  for (size_t k = 0; k < touches_.size(); ++k) {
    if (k == 0 || touches_[k].block != touches_[k - 1].block) starts_.push_back(k);
  }
  starts_.push_back(touches_.size());
}

void CellVoxelizer::FindTouches(const Eigen::AlignedBox3d& box, const IndexBox& limits) {
  const int edge = BlockEdge();
  const int64_t count = std::ssize(cells_);
  boxes_.resize(cells_.size());
  std::vector<std::vector<Touch>> parts((count + kCellsPerTask - 1) / kCellsPerTask);
  ParallelForBlocks(count, kCellsPerTask, [&](int64_t begin, int64_t end) {
    std::vector<Touch>& touches = parts[begin / kCellsPerTask];
    std::vector<HalfSpace> half_spaces;
    BlockSearch search(lattice_, edge);
    for (int64_t k = begin; k < end; ++k) {
      const uint32_t cell = cells_[k];
      if (scene_.delaunay.Neighbors(cell).empty()) continue;
      const Eigen::AlignedBox3d around = CellBox(scene_, cell, box);
      if (around.isEmpty()) continue;
      boxes_[k] = SamplesIn(around, lattice_, edge);
      boxes_[k].low = boxes_[k].low.cwiseMax(limits.low);
      boxes_[k].high = boxes_[k].high.cwiseMin(limits.high);
      if (boxes_[k].IsEmpty()) continue;
      const IndexBox blocks = BlocksOf(boxes_[k], edge);
      if (blocks.low == blocks.high) {
        touches.push_back({PackBlock(blocks.low), static_cast<uint32_t>(k)});
        continue;
      }
      ListHalfSpaces(scene_, cell, reach_, &half_spaces);
      search.Run(
          scene_.cell_positions[cell].cast<double>(), half_spaces, blocks, [&](uint64_t block) {
            touches.push_back({block, static_cast<uint32_t>(k)});
          });
    }
  });
  for (const std::vector<Touch>& part : parts) {
    touches_.insert(touches_.end(), part.begin(), part.end());
  }
  std::sort(touches_.begin(), touches_.end(), [](const Touch& a, const Touch& b) {
    return a.block != b.block ? a.block < b.block : a.cell < b.cell;
  });
}

bool CellVoxelizer::Fill(int64_t index, SampleBlock* block) const {
  const int edge = BlockEdge();
  const Eigen::Vector3i first_sample = edge * UnpackBlock(touches_[starts_[index]].block);
  block->origin = first_sample / samples_;
  block->samples = samples_;
  const size_t size = static_cast<size_t>(edge) * edge * edge;
  block->cells.assign(size, kNoCell);
  block->distances.assign(size, std::numeric_limits<double>::infinity());
  const Eigen::Vector3d corner =
      lattice_.origin + lattice_.voxel_size * first_sample.cast<double>();
  bool any = false;
  thread_local std::vector<HalfSpace> half_spaces;
  thread_local ColumnCutter cutter;
  for (size_t t = starts_[index]; t < starts_[index + 1]; ++t) {
    const uint32_t cell = cells_[touches_[t].cell];
    const IndexBox& box = boxes_[touches_[t].cell];
    const Eigen::Vector3i low = (box.low - first_sample).cwiseMax(0);
    const Eigen::Vector3i high = (box.high - first_sample).cwiseMin(edge - 1);
    const Eigen::Vector3d from_site = corner - scene_.cell_positions[cell].cast<double>();
    ListHalfSpaces(scene_, cell, reach_, &half_spaces);
    cutter.Set(half_spaces, from_site, lattice_.voxel_size);
    for (int x = low.x(); x <= high.x(); ++x) {
      const double to_x = from_site.x() + lattice_.voxel_size * x;
      for (int y = low.y(); y <= high.y(); ++y) {
        const double to_y = from_site.y() + lattice_.voxel_size * y;
        int z_low = low.z(), z_high = high.z();
        cutter.Cut(x, y, &z_low, &z_high);
        const size_t column = (static_cast<size_t>(x) * edge + y) * edge;
        for (int z = z_low; z <= z_high; ++z) {
          const double to_z = from_site.z() + lattice_.voxel_size * z;
          const double distance = to_x * to_x + to_y * to_y + to_z * to_z;
          if (distance < block->distances[column + z]) {
            block->distances[column + z] = distance;
            block->cells[column + z] = cell;
            any = true;
          }
        }
      }
    }
  }
  return any;
}

std::vector<VoxelBlock> VoxelizeCells(const ExportableScene& scene,
                                      const std::vector<uint32_t>& cells,
                                      const VoxelLattice& lattice,
                                      const Eigen::AlignedBox3d& box) {
  const CellVoxelizer voxelizer(scene, cells, lattice, box);
  const int64_t count = voxelizer.NumBlocks();
  std::vector<std::vector<VoxelBlock>> parts((count + kBlocksPerTask - 1) / kBlocksPerTask);
  ParallelForBlocks(count, kBlocksPerTask, [&](int64_t begin, int64_t end) {
    SampleBlock samples;
    for (int64_t k = begin; k < end; ++k) {
      if (!voxelizer.Fill(k, &samples)) continue;
      VoxelBlock& block = parts[begin / kBlocksPerTask].emplace_back();
      block.origin = samples.origin;
      std::copy(samples.cells.begin(), samples.cells.end(), block.cells.begin());
    }
  });
  std::vector<VoxelBlock> blocks;
  for (std::vector<VoxelBlock>& part : parts) {
    blocks.insert(blocks.end(), part.begin(), part.end());
    part = {};
  }
  return blocks;
}

}  // namespace semfoam
