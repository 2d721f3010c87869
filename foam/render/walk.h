// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/geometry/nearest_cell.h"
#include "foam/util/host_device.h"
#include "foam/util/large_pages.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

// The ray walk: from cell to cell through the Voronoi faces, in order along a ray, in float or
// double.
//
// In cell i, with n = p_j - p_i and r = o - p_i, the ray o + t d leaves through the neighbour j
// with n.d > 0 and the smallest t = (|n|^2 / 2 - r.n) / (n.d). Everything is relative to the site
// of the current cell: n (p_i + p_j) / 2 in the frame's own coordinates would cancel.
//
// Why it ends: p.d grows at every step, so no cell is visited twice. In exact arithmetic that is
// n.d > 0. In floating point n.d has the right sign where the face is not nearly parallel to the
// ray; through any other face only double may leave (ExitInDouble), which asks for p_j.d >
// p_i.d. So there is no cycle, whatever the rounding.
//
// Why it is accurate: a crossing has some rounding error, so near an edge of two faces either may
// come first, and the ray enters a corner of a cell that it misses by no more than that error. Only
// where sites nearly coincide can the wrong one of two cells be wrong along a whole segment; such
// cells, and their neighbours, are walked in double precision only.

namespace semfoam {

// The faces of a cell are stored in blocks of 16, each coordinate in its own row: a vector register
// of AVX-512 holds a row, smaller registers hold parts of it. Most cells have one or two blocks.
inline constexpr uint32_t kPlaneLanes = 16;

// 16 faces of a cell. Lanes beyond the last face have normal 0, so that no ray leaves through them,
// and neighbour kNoCell. In a cell that is walked in double precision, all lanes have normal 0 and
// half_squared 0, but their neighbours are set.
template <typename Real>
struct alignas(64) PlaneBlock {
  Real normal_x[kPlaneLanes];  // n = p_j - p_i
  Real normal_y[kPlaneLanes];
  Real normal_z[kPlaneLanes];
  Real half_squared[kPlaneLanes];  // |n|^2 / 2; 1 in empty lanes
  uint32_t neighbor[kPlaneLanes];  // j
};

// Borrowed arrays of a WalkGeometry, in the memory of the CPU or of a GPU: all that a ray reads of
// it.
template <typename Real>
struct WalkView {
  const Eigen::Matrix<Real, 3, 1>* positions = nullptr;
  const uint32_t* first_block = nullptr;
  const PlaneBlock<Real>* blocks = nullptr;
  uint32_t num_sites = 0;
  uint32_t num_cells = 0;

  // Returns whether the cell may have no exit: a guard's cell may be unbounded, unless it is walked
  // in double precision.
  SEMFOAM_HOST_DEVICE bool IsOpen(uint32_t cell) const {
    return cell >= num_sites && blocks[first_block[cell]].half_squared[0] != 0;
  }
};

// The cells of a foam, laid out for walking. Sites may move while the topology stays: Refresh()
// then recomputes the planes.
template <typename Real>
struct WalkGeometry {
  using Vector = Eigen::Matrix<Real, 3, 1>;

  std::vector<Vector> positions;             // [num_cells], guards included
  std::vector<uint32_t> first_block;         // [num_cells + 1]
  LargePageVector<PlaneBlock<Real>> blocks;  // those of cell i: first_block[i], ...
  uint32_t num_sites = 0;                    // cells beyond are guards

  operator WalkView<Real>() const {
    return {positions.data(),
            first_block.data(),
            blocks.data(),
            num_sites,
            static_cast<uint32_t>(positions.size())};
  }
};

// Computes the t at which the ray crosses the plane between two sites. r = o - p_i, n = p_j - p_i.
// Also for ceres::Jet.
template <typename T>
SEMFOAM_HOST_DEVICE T CrossingDistance(const Eigen::Matrix<T, 3, 1>& r,
                                       const Eigen::Matrix<T, 3, 1>& n,
                                       const Eigen::Matrix<T, 3, 1>& d) {
  return (T(0.5) * n.dot(n) - r.dot(n)) / n.dot(d);
}

// Returns whether the ray lies in the plane between the two sites to within 1e-5: the crossing is
// then undetermined to rounding, and its derivative unbounded. The gradient treats such a crossing
// as a constant.
template <typename T>
SEMFOAM_HOST_DEVICE bool IsGrazing(const Eigen::Matrix<T, 3, 1>& n,
                                   const Eigen::Matrix<T, 3, 1>& d) {
  const T nd = n.dot(d);
  return nd * nd < T(1e-10) * n.squaredNorm();
}

// Computes the derivatives of that t with respect to the two sites, x = o + t d being the crossing
// point: dt/dp_i = (x - p_i) / (n.d) and dt/dp_j = (p_j - x) / (n.d).
template <typename Real>
SEMFOAM_HOST_DEVICE void CrossingDerivatives(const Eigen::Matrix<Real, 3, 1>& r,
                                             const Eigen::Matrix<Real, 3, 1>& n,
                                             const Eigen::Matrix<Real, 3, 1>& d,
                                             Real t,
                                             Eigen::Matrix<Real, 3, 1>* dt_dpi,
                                             Eigen::Matrix<Real, 3, 1>* dt_dpj) {
  const Real inverse = Real(1) / n.dot(d);
  const Eigen::Matrix<Real, 3, 1> from_site = r + t * d;
  *dt_dpi = from_site * inverse;
  *dt_dpj = (n - from_site) * inverse;
}

// The exit of a cell. neighbor == kNoCell: the cell is unbounded along the ray.
template <typename Real>
struct CellExit {
  Real t = std::numeric_limits<Real>::infinity();
  uint32_t neighbor = kNoCell;
};

// Cosine of ray and normal up to which the sign of n.d is uncertain; 1e-5 is a hundred times its
// rounding error in float.
template <typename Real>
inline constexpr Real kSmallestCosine = std::is_same_v<Real, float> ? 1e-5 : 1e-13;

// Returns whether the cosine is greater, computed from n.d and |n|^2 / 2.
template <typename Real>
SEMFOAM_HOST_DEVICE bool IsCertain(Real nd, Real half_squared) {
  return nd * nd - 2 * kSmallestCosine<Real> * kSmallestCosine<Real> * half_squared > 0;
}

// Sites nearer to each other than this, times 1 + their distance from the origin, nearly coincide:
// they have the same faces to rounding.
template <typename Real>
inline constexpr Real kHardlyApart = 64 * std::numeric_limits<Real>::epsilon();

// Computes where the ray crosses the 16 planes of a block; infinity for planes with n.d <= 0. r =
// origin - site. The vector code (simd/walk-inl.h) does the same operations in the same order, so
// that it takes the same steps.
template <typename Real>
SEMFOAM_HOST_DEVICE void BlockCrossings(const PlaneBlock<Real>& block,
                                        const Eigen::Matrix<Real, 3, 1>& r,
                                        const Eigen::Matrix<Real, 3, 1>& direction,
                                        Real* crossings) {
  const Real dx = direction[0], dy = direction[1], dz = direction[2];
  const Real rx = r[0], ry = r[1], rz = r[2];
  // Compilers vectorise two plain loops with the select separate from the division.
  Real along[kPlaneLanes];
  for (uint32_t k = 0; k < kPlaneLanes; ++k) {
    const Real nx = block.normal_x[k], ny = block.normal_y[k], nz = block.normal_z[k];
    along[k] = nx * dx + ny * dy + nz * dz;
    crossings[k] = (block.half_squared[k] - (nx * rx + ny * ry + nz * rz)) / along[k];
  }
  for (uint32_t k = 0; k < kPlaneLanes; ++k) {
    crossings[k] = along[k] > 0 ? crossings[k] : std::numeric_limits<Real>::infinity();
  }
}

// Returns the smallest of a block's crossings, as a tree of minima of rows.
template <typename Real>
SEMFOAM_HOST_DEVICE Real Smallest(const Real* crossings) {
  Real smallest[kPlaneLanes];
  const auto fold = [&](const Real* row, uint32_t half) {
    for (uint32_t k = 0; k < half; ++k) smallest[k] = std::min(row[k], row[k + half]);
  };
  fold(crossings, 8);
  fold(smallest, 4);
  fold(smallest, 2);
  fold(smallest, 1);
  return smallest[0];
}

// Returns a mask whose bit k is set where crossings[k] == t.
template <typename Real>
SEMFOAM_HOST_DEVICE uint32_t LanesAt(const Real* crossings, Real t) {
  uint32_t lanes = 0;
  for (uint32_t k = 0; k < kPlaneLanes; ++k) lanes |= uint32_t{crossings[k] == t} << k;
  return lanes;
}

// Finds the exit of a cell in double precision: for ties, faces nearly parallel to the ray, and
// cells that are walked in double precision. Considers only sites farther along the ray. At equal
// t, chooses the larger n.d / |n|, which leaves an edge or a vertex in the fewest steps.
template <typename Real>
SEMFOAM_HOST_DEVICE CellExit<Real> ExitInDouble(
    const std::type_identity_t<WalkView<Real>>& geometry,
    uint32_t cell,
    const Eigen::Matrix<Real, 3, 1>& origin,
    const Eigen::Matrix<Real, 3, 1>& direction) {
  const Eigen::Vector3d d = direction.template cast<double>();
  const Eigen::Vector3d site = geometry.positions[cell].template cast<double>();
  const Eigen::Vector3d r = origin.template cast<double>() - site;
  const double here = site.dot(d);
  double nearest = std::numeric_limits<double>::infinity(), best_cosine = 0;
  CellExit<Real> exit;
  for (uint32_t b = geometry.first_block[cell]; b < geometry.first_block[cell + 1]; ++b) {
    for (const uint32_t neighbor : geometry.blocks[b].neighbor) {
      if (neighbor == kNoCell) break;
      const Eigen::Vector3d other = geometry.positions[neighbor].template cast<double>();
      const Eigen::Vector3d n = other - site;
      const double nd = n.dot(d);
      if (!(nd > 0) || !(other.dot(d) > here)) continue;
      const double t = CrossingDistance<double>(r, n, d);
      const double cosine = nd * nd / n.squaredNorm();
      if (t < nearest || (t == nearest && cosine > best_cosine)) {
        nearest = t;
        best_cosine = cosine;
        exit = {static_cast<Real>(t), neighbor};
      }
    }
  }
  return exit;
}

// Finds the face through which the ray leaves `cell`.
template <typename Real>
SEMFOAM_HOST_DEVICE CellExit<Real> FindExit(const std::type_identity_t<WalkView<Real>>& geometry,
                                            uint32_t cell,
                                            const Eigen::Matrix<Real, 3, 1>& origin,
                                            const Eigen::Matrix<Real, 3, 1>& direction) {
  const Eigen::Matrix<Real, 3, 1> r = origin - geometry.positions[cell];
  CellExit<Real> exit;
  bool certain = false;
  for (uint32_t b = geometry.first_block[cell]; b < geometry.first_block[cell + 1]; ++b) {
    const PlaneBlock<Real>& block = geometry.blocks[b];
    Real crossings[kPlaneLanes];
    BlockCrossings(block, r, direction, crossings);
    const Real nearest = Smallest(crossings);
    if (nearest > exit.t || nearest == std::numeric_limits<Real>::infinity()) continue;
    const uint32_t lanes = LanesAt(crossings, nearest);
    const int k = std::countr_zero(lanes);
    const Real nd = block.normal_x[k] * direction[0] + block.normal_y[k] * direction[1] +
                    block.normal_z[k] * direction[2];
    certain = nearest < exit.t && (lanes & (lanes - 1)) == 0 &&
              IsCertain<Real>(nd, block.half_squared[k]);
    exit = {nearest, block.neighbor[k]};
  }
  if (certain || (exit.neighbor == kNoCell && geometry.IsOpen(cell))) return exit;
  return ExitInDouble<Real>(geometry, cell, origin, direction);
}

// Calls ExitInDouble without inlining it, so that it is not compiled for the instruction set of
// vector code.
CellExit<float> FindExitInDouble(const WalkGeometry<float>& geometry,
                                 uint32_t cell,
                                 const Eigen::Vector3f& origin,
                                 const Eigen::Vector3f& direction);

// Walks from `start`, the cell whose site is nearest to `origin`, calling
//   visit(cell, t_in, t_out, next, clamped) -> bool: whether to continue
// for every cell that the ray leaves again: [t_in, t_out] is its segment of the ray, `next` the
// cell behind its exit face. clamped: the exit lay before the entry (rounding, or a topology older
// than the positions), so t_out = t_in does not depend on the face. The last, unbounded cell (a
// guard's) is not visited. Returns false if the walk hit the step limit, which cannot happen in a
// valid topology: no cell is visited twice, and the limit is the number of cells.
template <typename Real, typename Visitor>
SEMFOAM_HOST_DEVICE bool Walk(const std::type_identity_t<WalkView<Real>>& geometry,
                              const Eigen::Matrix<Real, 3, 1>& origin,
                              const Eigen::Matrix<Real, 3, 1>& direction,
                              uint32_t start,
                              Visitor&& visit) {
  const size_t limit = geometry.num_cells;
  uint32_t cell = start;
  Real t_in = 0;
  for (size_t step = 0; step <= limit; ++step) {
    const CellExit<Real> exit = FindExit<Real>(geometry, cell, origin, direction);
    if (exit.neighbor == kNoCell) return true;
    const bool clamped = exit.t < t_in;
    const Real t_out = clamped ? t_in : exit.t;
    if (!visit(cell, t_in, t_out, exit.neighbor, clamped)) return true;
    t_in = t_out;
    cell = exit.neighbor;
  }
  return false;
}

// Returns whether a topology older than the positions has led a ray astray: whether it has left
// more than a quarter of its cells, and several, before it entered them. Such a ray shows cells
// that it does not meet, or the linear colour of a cell far outside of it, with a loss and
// gradients up to a thousand times those of others. With the topology of the positions there is no
// such ray; in the first third of a long training, one in some thousand.
SEMFOAM_HOST_DEVICE inline bool IsAstray(int64_t num_segments, int64_t num_clamped) {
  constexpr int64_t kFewestClamped = 8;
  return num_clamped >= kFewestClamped && 4 * num_clamped > num_segments;
}

// Returns the cell nearest to `query` by the positions of the planes: see DescendToNearestCell.
// `start` may be any cell.
SEMFOAM_HOST_DEVICE inline uint32_t NearestCell(const WalkView<float>& geometry,
                                                const Eigen::Vector3d& query,
                                                uint32_t start) {
  const auto visit_neighbors = [&](uint32_t cell, const auto& visit) {
    for (uint32_t b = geometry.first_block[cell]; b < geometry.first_block[cell + 1]; ++b) {
      for (const uint32_t neighbor : geometry.blocks[b].neighbor) {
        if (neighbor != kNoCell) visit(neighbor);
      }
    }
  };
  // An empty cell (a duplicate site) has no neighbours; a guard always has some.
  const bool is_empty = geometry.first_block[start] == geometry.first_block[start + 1];
  return DescendToNearestCell(
      query,
      is_empty ? geometry.num_sites : start,
      [&](uint32_t cell) { return geometry.positions[cell]; },
      visit_neighbors);
}

// Returns whether a site nearly coincides with its nearest neighbour.
template <typename Real>
SEMFOAM_HOST_DEVICE bool IsHardlyApart(Real nearest_squared,
                                       const Eigen::Matrix<Real, 3, 1>& site) {
  const Real too_near = kHardlyApart<Real> * (1 + site.norm());
  return nearest_squared < too_near * too_near;
}

// Lays out the cells of a triangulation.
template <typename Real>
void SetTopology(const Delaunay& delaunay, WalkGeometry<Real>* geometry);

// Sets positions and planes for `cell_positions` (guards included), keeping the topology.
template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             WalkGeometry<Real>* geometry);

// Lays out the cells and sets their positions and planes.
template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             const Delaunay& delaunay,
             WalkGeometry<Real>* geometry) {
  SetTopology(delaunay, geometry);
  Refresh(cell_positions, geometry);
}

}  // namespace semfoam
