// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/walk.h"

#include "foam/parallel.h"

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int64_t kBlock = 4096;

}  // namespace

template <typename Real>
CellExit<Real> FindExitWithTies(const WalkGeometry<Real>& geometry,
                                uint32_t cell,
                                const Eigen::Matrix<Real, 3, 1>& origin,
                                const Eigen::Matrix<Real, 3, 1>& direction,
                                Real t_in) {
  const Eigen::Matrix<Real, 3, 1> r = origin - geometry.positions[cell];
  const uint32_t begin = geometry.first_block[cell], end = geometry.first_block[cell + 1];
  // A step of zero length: only towards a site that lies farther along the ray. In double, where
  // products of floats are exact: sites one ulp apart must still be told apart.
  const auto along = [&](uint32_t c) {
    return geometry.positions[c].template cast<double>().dot(direction.template cast<double>());
  };
  const double here = along(cell);

  CellExit<Real> exit;
  Real best_cosine = -1;
  Real crossings[kPlaneLanes];
  for (uint32_t b = begin; b < end; ++b) {
    const PlaneBlock<Real>& block = geometry.blocks[b];
    BlockCrossings(block, r, direction, crossings);
    for (uint32_t k = 0; k < kPlaneLanes; ++k) {
      const Real t = crossings[k];
      if (!(t <= exit.t) || t == std::numeric_limits<Real>::infinity()) continue;
      if (!(t > t_in) && !(along(block.neighbor[k]) > here)) continue;
      const Real nd = block.normal_x[k] * direction[0] + block.normal_y[k] * direction[1] +
                      block.normal_z[k] * direction[2];
      const Real cosine = nd * nd / block.half_squared[k];
      if (t == exit.t && !(cosine > best_cosine)) continue;
      exit = {t, block.neighbor[k]};
      best_cosine = cosine;
    }
  }
  return exit;
}

template <typename Real>
void SetTopology(const Delaunay& delaunay, WalkGeometry<Real>* geometry) {
  const uint32_t num_cells = delaunay.num_cells;
  geometry->num_sites = delaunay.num_sites;
  geometry->first_block.resize(num_cells + 1);
  geometry->first_block[0] = 0;
  uint64_t total = 0;
  for (uint32_t i = 0; i < num_cells; ++i) {
    total += (delaunay.offsets[i + 1] - delaunay.offsets[i] + kPlaneLanes - 1) / kPlaneLanes;
    CHECK_LT(total, uint64_t{kNoCell});
    geometry->first_block[i + 1] = static_cast<uint32_t>(total);
  }
  geometry->blocks.resize(total);
  ParallelForBlocks(num_cells, kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto neighbors = delaunay.Neighbors(i);
      PlaneBlock<Real>* blocks = geometry->blocks.data() + geometry->first_block[i];
      const size_t lanes =
          size_t{geometry->first_block[i + 1] - geometry->first_block[i]} * kPlaneLanes;
      for (size_t k = 0; k < lanes; ++k) {
        blocks[k / kPlaneLanes].neighbor[k % kPlaneLanes] =
            k < neighbors.size() ? neighbors[k] : kNoCell;
      }
    }
  });
}

template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             WalkGeometry<Real>* geometry) {
  CHECK_EQ(cell_positions.size() + 1, geometry->first_block.size());
  geometry->positions = cell_positions;
  ParallelForBlocks(cell_positions.size(), kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Eigen::Matrix<Real, 3, 1> site = cell_positions[i];
      for (uint32_t b = geometry->first_block[i]; b < geometry->first_block[i + 1]; ++b) {
        PlaneBlock<Real>& block = geometry->blocks[b];
        for (uint32_t k = 0; k < kPlaneLanes; ++k) {
          const uint32_t j = block.neighbor[k];
          const bool face = j != kNoCell;
          const Eigen::Matrix<Real, 3, 1> n = cell_positions[face ? j : i] - site;
          block.normal_x[k] = n[0];
          block.normal_y[k] = n[1];
          block.normal_z[k] = n[2];
          block.half_squared[k] = face ? Real(0.5) * n.squaredNorm() : Real(1);
        }
      }
    }
  });
}

template CellExit<float> FindExitWithTies(
    const WalkGeometry<float>&, uint32_t, const Eigen::Vector3f&, const Eigen::Vector3f&, float);
template CellExit<double> FindExitWithTies(
    const WalkGeometry<double>&, uint32_t, const Eigen::Vector3d&, const Eigen::Vector3d&, double);
template void SetTopology(const Delaunay&, WalkGeometry<float>*);
template void SetTopology(const Delaunay&, WalkGeometry<double>*);
template void Refresh(const std::vector<Eigen::Vector3f>&, WalkGeometry<float>*);
template void Refresh(const std::vector<Eigen::Vector3d>&, WalkGeometry<double>*);

}  // namespace semfoam
