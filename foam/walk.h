// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/delaunay.h"
#include "foam/large_pages.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

// The ray walk: from cell to cell through the Voronoi faces, in order along a ray, in float or
// double.
//
// In cell i, with n = p_j - p_i and r = o - p_i, the ray o + t d leaves through the neighbour j
// with n.d > 0 and the smallest t = (|n|^2 / 2 - r.n) / (n.d). Everything is relative to the site
// of the current cell: n (p_i + p_j) / 2 in the frame's own coordinates would cancel.
//
// Why it ends: in exact arithmetic p.d grows at every step. In floating point a step forward in t
// cannot return to where it came from, so a cycle could only consist of steps of zero length; and
// such a step is taken only if fl(p_j.d) > fl(p_i.d), both computed from the sites themselves. So
// there is no cycle, whatever the rounding.

namespace semfoam {

// The faces of a cell come in blocks of 16, each coordinate in a row of its own: a vector register
// of AVX-512 takes a row at once, smaller ones take it in parts. Most cells are one block or two.
inline constexpr uint32_t kPlaneLanes = 16;

// 16 faces as their cell sees them. Lanes beyond the last face have normal 0, so that no ray leaves
// through them, and neighbour kNoCell.
template <typename Real>
struct alignas(64) PlaneBlock {
  Real normal_x[kPlaneLanes];  // n = p_j - p_i
  Real normal_y[kPlaneLanes];
  Real normal_z[kPlaneLanes];
  Real half_squared[kPlaneLanes];  // |n|^2 / 2; 1 in empty lanes
  uint32_t neighbor[kPlaneLanes];  // j
};

// The cells of a foam, laid out for walking. Sites may move while the topology stays: Refresh()
// then brings the planes along.
template <typename Real>
struct WalkGeometry {
  using Vector = Eigen::Matrix<Real, 3, 1>;

  std::vector<Vector> positions;             // [num_cells], guards included
  std::vector<uint32_t> first_block;         // [num_cells + 1]
  LargePageVector<PlaneBlock<Real>> blocks;  // those of cell i: first_block[i], ...
  uint32_t num_sites = 0;                    // cells beyond are guards
};

// t at which the ray crosses the plane between two sites. r = o - p_i, n = p_j - p_i. Also for
// ceres::Jet.
template <typename T>
T CrossingDistance(const Eigen::Matrix<T, 3, 1>& r,
                   const Eigen::Matrix<T, 3, 1>& n,
                   const Eigen::Matrix<T, 3, 1>& d) {
  return (T(0.5) * n.dot(n) - r.dot(n)) / n.dot(d);
}

// The ray runs in the plane between the two sites, to within 1e-5: its crossing is then anywhere,
// to rounding, and its derivative without bound. Such a crossing counts as a constant of the
// gradient.
template <typename T>
bool IsGrazing(const Eigen::Matrix<T, 3, 1>& n, const Eigen::Matrix<T, 3, 1>& d) {
  const T nd = n.dot(d);
  return nd * nd < T(1e-10) * n.squaredNorm();
}

// Derivatives of that t with respect to the two sites, x = o + t d being the crossing point:
// dt/dp_i = (x - p_i) / (n.d) and dt/dp_j = (p_j - x) / (n.d).
template <typename Real>
void CrossingDerivatives(const Eigen::Matrix<Real, 3, 1>& r,
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

// Where the ray crosses the 16 planes of a block, infinity for those that do not look along it. r =
// origin - site. The vector code (ray_kernels-inl.h) does the very same operations in the same
// order, so that it takes the very same steps.
template <typename Real>
void BlockCrossings(const PlaneBlock<Real>& block,
                    const Eigen::Matrix<Real, 3, 1>& r,
                    const Eigen::Matrix<Real, 3, 1>& direction,
                    Real* crossings) {
  const Real dx = direction[0], dy = direction[1], dz = direction[2];
  const Real rx = r[0], ry = r[1], rz = r[2];
  // Two plain loops, and the select apart from the division, are what compilers turn into vector
  // code.
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

// The smallest of a block's crossings, as a tree of minima of rows.
template <typename Real>
Real Smallest(const Real* crossings) {
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

// Bit k is set where crossings[k] == t.
template <typename Real>
uint32_t LanesAt(const Real* crossings, Real t) {
  uint32_t lanes = 0;
  for (uint32_t k = 0; k < kPlaneLanes; ++k) lanes |= uint32_t{crossings[k] == t} << k;
  return lanes;
}

// FindExit for the rare cells where the nearest crossing alone does not decide: several faces at
// the same t, or an exit that does not lie beyond the entry.
template <typename Real>
CellExit<Real> FindExitWithTies(const WalkGeometry<Real>& geometry,
                                uint32_t cell,
                                const Eigen::Matrix<Real, 3, 1>& origin,
                                const Eigen::Matrix<Real, 3, 1>& direction,
                                Real t_in);

// The face through which the ray leaves `cell`, which it entered at t_in. Equal t: the larger n.d /
// |n|, which leaves an edge or a vertex in the fewest steps.
template <typename Real>
CellExit<Real> FindExit(const WalkGeometry<Real>& geometry,
                        uint32_t cell,
                        const Eigen::Matrix<Real, 3, 1>& origin,
                        const Eigen::Matrix<Real, 3, 1>& direction,
                        Real t_in) {
  const Eigen::Matrix<Real, 3, 1> r = origin - geometry.positions[cell];
  const uint32_t begin = geometry.first_block[cell], end = geometry.first_block[cell + 1];
  CellExit<Real> exit;
  bool tie = false;
  for (uint32_t b = begin; b < end; ++b) {
    const PlaneBlock<Real>& block = geometry.blocks[b];
    Real crossings[kPlaneLanes];
    BlockCrossings(block, r, direction, crossings);
    const Real nearest = Smallest(crossings);
    if (nearest > exit.t || nearest == std::numeric_limits<Real>::infinity()) continue;
    const uint32_t lanes = LanesAt(crossings, nearest);
    tie = nearest == exit.t || (lanes & (lanes - 1)) != 0;
    exit = {nearest, block.neighbor[std::countr_zero(lanes)]};
  }
  if (exit.neighbor == kNoCell || (!tie && exit.t > t_in)) return exit;
  return FindExitWithTies(geometry, cell, origin, direction, t_in);
}

// Walks from `start`, the cell whose site is nearest to `origin`, calling
//   visit(cell, t_in, t_out, next, clamped) -> bool: go on?
// for every cell that the ray leaves again: [t_in, t_out] is its piece of the ray, `next` the cell
// behind its exit face. clamped: the exit lay before the entry (rounding, or a topology older than
// the positions), so t_out = t_in, and the face has no say in it. The last, unbounded cell (a
// guard's) is not visited. Returns false if the walk was cut by the step limit, which a valid
// topology never does: no cell is visited twice, and the limit is the number of cells.
template <typename Real, typename Visitor>
bool Walk(const WalkGeometry<Real>& geometry,
          const Eigen::Matrix<Real, 3, 1>& origin,
          const Eigen::Matrix<Real, 3, 1>& direction,
          uint32_t start,
          Visitor&& visit) {
  const size_t limit = geometry.positions.size();
  uint32_t cell = start;
  Real t_in = 0;
  for (size_t step = 0; step <= limit; ++step) {
    const CellExit<Real> exit = FindExit(geometry, cell, origin, direction, t_in);
    if (exit.neighbor == kNoCell) return true;
    const bool clamped = exit.t < t_in;
    const Real t_out = clamped ? t_in : exit.t;
    if (!visit(cell, t_in, t_out, exit.neighbor, clamped)) return true;
    t_in = t_out;
    cell = exit.neighbor;
  }
  return false;
}

// Lays out the cells of a triangulation.
template <typename Real>
void SetTopology(const Delaunay& delaunay, WalkGeometry<Real>* geometry);

// Sets positions and planes for `cell_positions` (guards included), on the topology set last.
template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             WalkGeometry<Real>* geometry);

// Both.
template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             const Delaunay& delaunay,
             WalkGeometry<Real>* geometry) {
  SetTopology(delaunay, geometry);
  Refresh(cell_positions, geometry);
}

}  // namespace semfoam
