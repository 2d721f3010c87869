// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/walk.h"

#include "foam/render/update_loops.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <atomic>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int64_t kBlock = 4096;

}  // namespace

CellExit<float> FindExitInDouble(const WalkGeometry<float>& geometry,
                                 uint32_t cell,
                                 const Eigen::Vector3f& origin,
                                 const Eigen::Vector3f& direction) {
  return ExitInDouble<float>(geometry, cell, origin, direction);
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

namespace {

// Computes the planes of cells [begin, end). Sets has_twin[i] = 1 where a site nearly coincides
// with a neighbour.
void RefreshPlanes(int64_t begin,
                   int64_t end,
                   WalkGeometry<double>* geometry,
                   std::vector<uint8_t>* has_twin) {
  for (int64_t i = begin; i < end; ++i) {
    const Eigen::Vector3d& site = geometry->positions[i];
    double nearest = std::numeric_limits<double>::infinity();
    for (uint32_t b = geometry->first_block[i]; b < geometry->first_block[i + 1]; ++b) {
      PlaneBlock<double>& block = geometry->blocks[b];
      for (uint32_t k = 0; k < kPlaneLanes; ++k) {
        const uint32_t j = block.neighbor[k];
        const Eigen::Vector3d n = geometry->positions[j != kNoCell ? j : i] - site;
        block.normal_x[k] = n[0];
        block.normal_y[k] = n[1];
        block.normal_z[k] = n[2];
        block.half_squared[k] = j != kNoCell ? 0.5 * n.squaredNorm() : 1;
        nearest = std::min(nearest, 2 * block.half_squared[k]);
      }
    }
    (*has_twin)[i] = IsHardlyApart(nearest, site);
  }
}

void RefreshPlanes(int64_t begin,
                   int64_t end,
                   WalkGeometry<float>* geometry,
                   std::vector<uint8_t>* has_twin) {
  std::vector<float> nearest(end - begin);
  PlanesFromSites(geometry->positions.data(),
                  geometry->first_block.data(),
                  begin,
                  end,
                  geometry->blocks.data(),
                  nearest.data());
  for (int64_t i = begin; i < end; ++i) {
    (*has_twin)[i] = IsHardlyApart(nearest[i - begin], geometry->positions[i]);
  }
}

}  // namespace

template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             WalkGeometry<Real>* geometry) {
  const size_t num_cells = cell_positions.size();
  CHECK_EQ(num_cells + 1, geometry->first_block.size());
  CHECK_LT(num_cells, size_t{1} << 29);  // vector code finds coordinates by a signed index
  geometry->positions = cell_positions;
  std::vector<uint8_t> has_twin(num_cells, 0);
  std::atomic<bool> any_twins = false;
  ParallelForBlocks(num_cells, kBlock, [&](int64_t begin, int64_t end) {
    RefreshPlanes(begin, end, geometry, &has_twin);
    if (std::any_of(
            &has_twin[begin], &has_twin[begin] + (end - begin), [](uint8_t t) { return t != 0; })) {
      any_twins = true;
    }
  });
  if (!any_twins) return;
  ParallelForBlocks(num_cells, kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      PlaneBlock<Real>* const blocks = geometry->blocks.data() + geometry->first_block[i];
      const uint32_t num_blocks = geometry->first_block[i + 1] - geometry->first_block[i];
      bool in_double = has_twin[i];
      for (uint32_t b = 0; b < num_blocks && !in_double; ++b) {
        for (const uint32_t j : blocks[b].neighbor) in_double |= j != kNoCell && has_twin[j];
      }
      if (!in_double) continue;
      for (uint32_t b = 0; b < num_blocks; ++b) {
        for (Real* row :
             {blocks[b].normal_x, blocks[b].normal_y, blocks[b].normal_z, blocks[b].half_squared}) {
          std::fill_n(row, kPlaneLanes, Real(0));
        }
      }
    }
  });
}

template void SetTopology(const Delaunay&, WalkGeometry<float>*);
template void SetTopology(const Delaunay&, WalkGeometry<double>*);
template void Refresh(const std::vector<Eigen::Vector3f>&, WalkGeometry<float>*);
template void Refresh(const std::vector<Eigen::Vector3d>&, WalkGeometry<double>*);

}  // namespace semfoam
