// SPDX-License-Identifier: GPL-3.0-or-later
//
// One step of the walk with vector instructions. Compiled once per instruction set
// (foam/render/simd/kernels.cc), hence the guard that toggles.
#if defined(SEMFOAM_SIMD_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SEMFOAM_SIMD_WALK_INL_H_
#undef SEMFOAM_SIMD_WALK_INL_H_
#else
#define SEMFOAM_SIMD_WALK_INL_H_
#endif

#include "foam/render/walk.h"

#include <limits>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace semfoam {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// At most a block's row per register; smaller registers take a row in parts.
using FloatTag = hn::CappedTag<float, kPlaneLanes>;
using IndexTag = hn::Repartition<uint32_t, FloatTag>;
using Floats = hn::Vec<FloatTag>;

// Computes FindExit with the same operations in the same order, and so the same result bit for bit
// (no fused multiply-add, which not every instruction set has). Each lane keeps its own minimum and
// the corresponding neighbour until all blocks are processed, so that a step has one horizontal
// minimum and no branch except the loop over blocks.
HWY_INLINE CellExit<float> FindExitSimd(const WalkGeometry<float>& geometry,
                                        uint32_t cell,
                                        const Eigen::Vector3f& origin,
                                        const Eigen::Vector3f& direction) {
  const FloatTag f;
  const IndexTag u;
  constexpr size_t kStep = hn::MaxLanes(f);
  const Eigen::Vector3f& site = geometry.positions[cell];
  const Floats dx = hn::Set(f, direction[0]);
  const Floats dy = hn::Set(f, direction[1]);
  const Floats dz = hn::Set(f, direction[2]);
  const Floats rx = hn::Set(f, origin[0] - site[0]);
  const Floats ry = hn::Set(f, origin[1] - site[1]);
  const Floats rz = hn::Set(f, origin[2] - site[2]);
  const Floats grazing = hn::Set(f, 2 * kSmallestCosine<float> * kSmallestCosine<float>);
  const Floats infinity = hn::Set(f, std::numeric_limits<float>::infinity());
  // Of a row: crossings, and whether the sign of n.d is certain where there is one.
  struct Row {
    Floats t;
    hn::Mask<FloatTag> certain;
  };
  const auto crossings = [&](const PlaneBlock<float>& block, size_t lane) HWY_ATTR {
    const Floats nx = hn::Load(f, block.normal_x + lane);
    const Floats ny = hn::Load(f, block.normal_y + lane);
    const Floats nz = hn::Load(f, block.normal_z + lane);
    const Floats h = hn::Load(f, block.half_squared + lane);
    const Floats nd = hn::Add(hn::Add(hn::Mul(nx, dx), hn::Mul(ny, dy)), hn::Mul(nz, dz));
    const Floats nr = hn::Add(hn::Add(hn::Mul(nx, rx), hn::Mul(ny, ry)), hn::Mul(nz, rz));
    const Floats t = hn::Div(hn::Sub(h, nr), nd);
    return Row{hn::IfThenElse(hn::Gt(nd, hn::Zero(f)), t, infinity),
               hn::Gt(hn::Sub(hn::Mul(nd, nd), hn::Mul(grazing, h)), hn::Zero(f))};
  };

  const PlaneBlock<float>* block = geometry.blocks.data() + geometry.first_block[cell];
  const PlaneBlock<float>* const end = geometry.blocks.data() + geometry.first_block[cell + 1];
  if (HWY_UNLIKELY(block == end)) return {};  // the empty cell of a duplicate site
  // Of each lane: its nearest crossing, the neighbour there, and whether it stands alone and is
  // certain.
  auto [best, sure] = crossings(*block, 0);
  auto neighbor = hn::Load(u, block->neighbor);
  const auto merge = [&](size_t lane) HWY_ATTR {
    const auto [t, certain] = crossings(*block, lane);
    const auto nearer = hn::Lt(t, best);
    sure = hn::AndNot(hn::Eq(t, best), hn::Or(hn::AndNot(nearer, sure), hn::And(nearer, certain)));
    best = hn::Min(t, best);
    neighbor =
        hn::IfThenElse(hn::RebindMask(u, nearer), hn::Load(u, block->neighbor + lane), neighbor);
  };
  for (size_t lane = kStep; lane < kPlaneLanes; lane += kStep) merge(lane);
  for (++block; block != end; ++block) {
    for (size_t lane = 0; lane < kPlaneLanes; lane += kStep) merge(lane);
  }
  const Floats nearest = hn::MinOfLanes(f, best);
  const auto is_nearest = hn::Eq(best, nearest);
  const uint32_t next = hn::GetLane(hn::Compress(neighbor, hn::RebindMask(u, is_nearest)));
  // Without any exit all lanes are infinite.
  if (HWY_LIKELY(hn::CountTrue(f, is_nearest) == 1 &&
                 !hn::AllFalse(f, hn::And(sure, is_nearest)))) {
    return {hn::GetLane(nearest), next};
  }
  if (hn::GetLane(nearest) == std::numeric_limits<float>::infinity() &&
      WalkView<float>(geometry).IsOpen(cell)) {
    return {};
  }
  return FindExitInDouble(geometry, cell, origin, direction);
}

template <int kRays>
void WalkGroup(const WalkGeometry<float>& geometry, const WalkQuery* rays, WalkResult* results) {
  uint32_t cell[kRays];
  bool alive[kRays];
  for (int r = 0; r < kRays; ++r) {
    cell[r] = rays[r].start_cell;
    alive[r] = true;
    results[r] = {0, 0};
  }
  const size_t limit = geometry.positions.size();
  int num_alive = kRays;
  for (size_t step = 0; step <= limit && num_alive > 0; ++step) {
    for (int r = 0; r < kRays; ++r) {
      if (!alive[r]) continue;
      const CellExit<float> exit =
          FindExitSimd(geometry, cell[r], rays[r].origin, rays[r].direction);
      if (exit.neighbor == kNoCell) {
        alive[r] = false;
        --num_alive;
        continue;
      }
      ++results[r].steps;
      results[r].t_exit = HWY_MAX(results[r].t_exit, exit.t);
      cell[r] = exit.neighbor;
    }
  }
}

void WalkRays(const WalkGeometry<float>& geometry,
              const WalkQuery* rays,
              size_t count,
              int rays_in_flight,
              WalkResult* results) {
  size_t i = 0;
  const auto walk_groups = [&]<int kRays>(std::integral_constant<int, kRays>) {
    for (; i + kRays <= count; i += kRays) WalkGroup<kRays>(geometry, rays + i, results + i);
  };
  if (rays_in_flight >= 8) walk_groups(std::integral_constant<int, 8>());
  if (rays_in_flight >= 4) walk_groups(std::integral_constant<int, 4>());
  if (rays_in_flight >= 2) walk_groups(std::integral_constant<int, 2>());
  walk_groups(std::integral_constant<int, 1>());
}

}  // namespace HWY_NAMESPACE
}  // namespace semfoam
HWY_AFTER_NAMESPACE();

#endif
