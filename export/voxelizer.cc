// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/voxelizer.h"

#include "foam/guard_sites.h"
#include "foam/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int64_t kCellsPerTask = 256;
constexpr int64_t kBlocksPerTask = 64;
constexpr int64_t kMaxIndex = int64_t{1} << 23;

// Inclusive ranges of indices along the three axes.
struct IndexBox {
  Eigen::Vector3i low;
  Eigen::Vector3i high;
  bool IsEmpty() const { return (low.array() > high.array()).any(); }
};

// The half-space of one neighbour: x is nearer to the cell's site p than to the neighbour's exactly
// if normal . (x - p) <= offset. The offset is a touch too large: a centre on a face, or beside it
// by less than rounding, belongs to both cells here, and the comparison of distances decides.
struct HalfSpace {
  Eigen::Vector3d normal;
  double offset;
};

// A block that a cell touches.
struct Touch {
  uint64_t block;
  uint32_t cell;
  bool operator<(const Touch& other) const {
    return block != other.block ? block < other.block : cell < other.cell;
  }
};

constexpr int kBlockBits = 21;
constexpr int kBlockBias = 1 << (kBlockBits - 1);

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

// The voxels whose centres lie in `box`.
IndexBox CentersIn(const Eigen::AlignedBox3d& box, const VoxelLattice& lattice) {
  IndexBox result;
  for (int a = 0; a < 3; ++a) {
    const double low = std::ceil((box.min()[a] - lattice.origin[a]) / lattice.voxel_size - 1e-9);
    const double high = std::floor((box.max()[a] - lattice.origin[a]) / lattice.voxel_size + 1e-9);
    CHECK_GE(low, -kMaxIndex);
    CHECK_LE(high, kMaxIndex);
    result.low[a] = static_cast<int>(low);
    result.high[a] = static_cast<int>(high);
  }
  return result;
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
  BlockSearch(const VoxelLattice& lattice, std::vector<Touch>* touches)
      : lattice_(lattice), touches_(touches) {}

  void Run(uint32_t cell,
           const Eigen::Vector3d& site,
           const std::vector<HalfSpace>& half_spaces,
           const IndexBox& blocks) {
    cell_ = cell;
    site_ = site;
    Visit(blocks, half_spaces, 0);
  }

 private:
  void Visit(const IndexBox& blocks, const std::vector<HalfSpace>& half_spaces, size_t depth) {
    const Eigen::Vector3d low =
        lattice_.origin + lattice_.voxel_size * (8 * blocks.low).cast<double>() - site_;
    const Eigen::Vector3d high =
        lattice_.origin +
        lattice_.voxel_size * (8 * blocks.high + Eigen::Vector3i::Constant(7)).cast<double>() -
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
        touches_->push_back({PackBlock(blocks.low), cell_});
      } else {
        IndexBox part = blocks;
        part.high[axis] = blocks.low[axis] + length / 2;
        Visit(part, live, depth + 1);
        part = blocks;
        part.low[axis] = blocks.low[axis] + length / 2 + 1;
        Visit(part, live, depth + 1);
      }
    }
    levels_[depth] = std::move(live);
  }

  const VoxelLattice& lattice_;
  std::vector<Touch>* touches_;
  uint32_t cell_ = kNoCell;
  Eigen::Vector3d site_ = Eigen::Vector3d::Zero();
  std::vector<std::vector<HalfSpace>> levels_;  // storage of `live`, kept between cells
};

std::vector<Touch> TouchedBlocks(const ExportableScene& scene,
                                 const std::vector<uint32_t>& cells,
                                 const VoxelLattice& lattice,
                                 const Eigen::AlignedBox3d& box) {
  const int64_t count = static_cast<int64_t>(cells.size());
  const double reach = box.diagonal().norm() + kFarRadius;
  std::vector<std::vector<Touch>> parts((count + kCellsPerTask - 1) / kCellsPerTask);
  ParallelForBlocks(count, kCellsPerTask, [&](int64_t begin, int64_t end) {
    std::vector<HalfSpace> half_spaces;
    BlockSearch search(lattice, &parts[begin / kCellsPerTask]);
    for (int64_t k = begin; k < end; ++k) {
      const uint32_t cell = cells[k];
      if (scene.delaunay.Neighbors(cell).empty()) continue;
      const Eigen::AlignedBox3d around = CellBox(scene, cell, box);
      if (around.isEmpty()) continue;
      IndexBox blocks = CentersIn(around, lattice);
      if (blocks.IsEmpty()) continue;
      for (int a = 0; a < 3; ++a) {
        blocks.low[a] >>= 3;
        blocks.high[a] >>= 3;
      }
      ListHalfSpaces(scene, cell, reach, &half_spaces);
      search.Run(cell, scene.cell_positions[cell].cast<double>(), half_spaces, blocks);
    }
  });
  std::vector<Touch> touches;
  for (const std::vector<Touch>& part : parts) {
    touches.insert(touches.end(), part.begin(), part.end());
  }
  std::sort(touches.begin(), touches.end());
  return touches;
}

// Cuts z_low..z_high (indices along one column) to the half-spaces. `column` is the centre of the
// column's voxel z = 0, relative to the site.
void CutColumn(const std::vector<HalfSpace>& half_spaces,
               const Eigen::Vector3d& column,
               double voxel_size,
               int* z_low,
               int* z_high) {
  double low = *z_low;
  double high = *z_high;
  for (const HalfSpace& h : half_spaces) {
    const double room = h.offset - h.normal.dot(column);
    const double slope = h.normal.z() * voxel_size;
    if (slope > 0) {
      high = std::min(high, std::floor(room / slope));
    } else if (slope < 0) {
      low = std::max(low, std::ceil(room / slope));
    } else if (room < 0) {
      high = low - 1;
    }
    if (low > high) break;
  }
  *z_low = low > high ? 1 : static_cast<int>(low);
  *z_high = low > high ? 0 : static_cast<int>(high);
}

// Gives the voxels of one block to the cells that touch it; false if none of them gets any.
bool FillBlock(const ExportableScene& scene,
               const VoxelLattice& lattice,
               const Eigen::AlignedBox3d& box,
               const IndexBox& limits,
               const Touch* first,
               const Touch* last,
               VoxelBlock* block) {
  block->origin = 8 * UnpackBlock(first->block);
  block->cells.fill(kNoCell);
  std::array<double, 512> nearest;
  nearest.fill(std::numeric_limits<double>::infinity());
  const Eigen::Vector3i low = (limits.low - block->origin).cwiseMax(0);
  const Eigen::Vector3i high = (limits.high - block->origin).cwiseMin(7);
  const double reach = box.diagonal().norm() + kFarRadius;
  bool any = false;
  std::vector<HalfSpace> half_spaces;
  for (const Touch* touch = first; touch != last; ++touch) {
    const Eigen::Vector3d site = scene.cell_positions[touch->cell].cast<double>();
    ListHalfSpaces(scene, touch->cell, reach, &half_spaces);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        const Eigen::Vector3d column =
            lattice.origin +
            lattice.voxel_size * (block->origin + Eigen::Vector3i(x, y, 0)).cast<double>() - site;
        int z_low = low.z(), z_high = high.z();
        CutColumn(half_spaces, column, lattice.voxel_size, &z_low, &z_high);
        for (int z = z_low; z <= z_high; ++z) {
          const double height = column.z() + lattice.voxel_size * z;
          const double distance = column.head<2>().squaredNorm() + height * height;
          const int voxel = 64 * x + 8 * y + z;
          if (distance < nearest[voxel]) {
            nearest[voxel] = distance;
            block->cells[voxel] = touch->cell;
            any = true;
          }
        }
      }
    }
  }
  return any;
}

}  // namespace

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

std::vector<VoxelBlock> VoxelizeCells(const ExportableScene& scene,
                                      const std::vector<uint32_t>& cells,
                                      const VoxelLattice& lattice,
                                      const Eigen::AlignedBox3d& box) {
  CHECK_GT(lattice.voxel_size, 0);
  if (box.isEmpty()) return {};
  const IndexBox limits = CentersIn(box, lattice);
  if (limits.IsEmpty()) return {};
  const std::vector<Touch> touches = TouchedBlocks(scene, cells, lattice, box);
  std::vector<size_t> starts;
  for (size_t k = 0; k < touches.size(); ++k) {
    if (k == 0 || touches[k].block != touches[k - 1].block) starts.push_back(k);
  }
  starts.push_back(touches.size());

  const int64_t num_blocks = static_cast<int64_t>(starts.size()) - 1;
  std::vector<std::vector<VoxelBlock>> parts((num_blocks + kBlocksPerTask - 1) / kBlocksPerTask);
  ParallelForBlocks(num_blocks, kBlocksPerTask, [&](int64_t begin, int64_t end) {
    std::vector<VoxelBlock>& out = parts[begin / kBlocksPerTask];
    VoxelBlock block;
    for (int64_t k = begin; k < end; ++k) {
      const Touch* first = touches.data() + starts[k];
      const Touch* last = touches.data() + starts[k + 1];
      if (FillBlock(scene, lattice, box, limits, first, last, &block)) out.push_back(block);
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
