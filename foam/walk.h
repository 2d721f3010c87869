// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/delaunay.h"

#include <algorithm>
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
// Why it ends: p.d grows at every step, so no cell is visited twice. In exact arithmetic that is
// n.d > 0. In floating point it holds where the face is not nearly parallel to the ray; there, and
// where two crossings lie closer than their rounding, double decides (FindExitInDouble), and asks
// for p_j.d > p_i.d, both computed from the sites themselves. So there is no cycle, whatever the
// rounding.

namespace semfoam {

inline constexpr uint32_t kNoEdge = 0xffffffffu;

// A face as its cell sees it.
template <typename Real>
struct FacePlane {
  Eigen::Matrix<Real, 3, 1> normal;  // n = p_j - p_i
  Real half_squared;                 // |n|^2 / 2
};

// The cells of a foam, laid out for walking. Sites may move while the topology stays: Refresh()
// then brings the planes along.
template <typename Real>
struct WalkGeometry {
  using Vector = Eigen::Matrix<Real, 3, 1>;

  const Delaunay* delaunay = nullptr;
  std::vector<Vector> positions;        // [num_cells], guards included
  std::vector<FacePlane<Real>> planes;  // one per directed edge, aligned with delaunay->neighbors
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

// The exit of a cell. edge == kNoEdge: the cell is unbounded along the ray.
template <typename Real>
struct CellExit {
  Real t = std::numeric_limits<Real>::infinity();
  uint32_t edge = kNoEdge;  // index into delaunay->neighbors
};

// The exit from what double makes of the sites, for the steps that Real cannot be trusted with.
// Only to sites farther along the ray. Equal t: the larger n.d / |n|, which leaves an edge or a
// vertex in the fewest steps. Not inlined, to keep what hardly ever runs out of the loop that
// always does.
template <typename Real>
[[gnu::noinline]] CellExit<Real> FindExitInDouble(const WalkGeometry<Real>& geometry,
                                                  uint32_t cell,
                                                  const Eigen::Matrix<Real, 3, 1>& origin,
                                                  const Eigen::Matrix<Real, 3, 1>& direction) {
  const Delaunay& delaunay = *geometry.delaunay;
  const Eigen::Vector3d d = direction.template cast<double>();
  const Eigen::Vector3d site = geometry.positions[cell].template cast<double>();
  const Eigen::Vector3d r = origin.template cast<double>() - site;
  const double here = site.dot(d);
  double nearest = std::numeric_limits<double>::infinity(), best_cosine = 0;
  CellExit<Real> exit;
  for (uint32_t e = delaunay.offsets[cell]; e < delaunay.offsets[cell + 1]; ++e) {
    const Eigen::Vector3d other = geometry.positions[delaunay.neighbors[e]].template cast<double>();
    const Eigen::Vector3d n = other - site;
    const double nd = n.dot(d);
    if (!(nd > 0) || !(other.dot(d) > here)) continue;
    const double t = CrossingDistance<double>(r, n, d);
    const double cosine = nd * nd / n.squaredNorm();
    if (t < nearest || (t == nearest && cosine > best_cosine)) {
      nearest = t;
      best_cosine = cosine;
      exit = {static_cast<Real>(t), e};
    }
  }
  return exit;
}

// The face through which the ray leaves `cell`.
template <typename Real>
CellExit<Real> FindExit(const WalkGeometry<Real>& geometry,
                        uint32_t cell,
                        const Eigen::Matrix<Real, 3, 1>& origin,
                        const Eigen::Matrix<Real, 3, 1>& direction) {
  const Delaunay& delaunay = *geometry.delaunay;
  const Eigen::Matrix<Real, 3, 1> r = origin - geometry.positions[cell];
  const uint32_t begin = delaunay.offsets[cell], end = delaunay.offsets[cell + 1];
  // Whether a face looks along the ray, and whether it is the nearest so far, is as good as random;
  // so there is no branch on either. First all crossings of a chunk, a loop that compilers turn
  // into vector code, then their minimum.
  CellExit<Real> exit;
  Real second = std::numeric_limits<Real>::infinity();
  constexpr uint32_t kChunk = 32;
  Real crossings[kChunk];
  const Real dx = direction[0], dy = direction[1], dz = direction[2];
  const Real rx = r[0], ry = r[1], rz = r[2];
  for (uint32_t chunk = begin; chunk < end; chunk += kChunk) {
    const FacePlane<Real>* planes = geometry.planes.data() + chunk;
    const uint32_t count = std::min(kChunk, end - chunk);
    for (uint32_t k = 0; k < count; ++k) {
      const Real nx = planes[k].normal[0], ny = planes[k].normal[1], nz = planes[k].normal[2];
      const Real nd = nx * dx + ny * dy + nz * dz;
      const Real t = (planes[k].half_squared - (nx * rx + ny * ry + nz * rz)) / nd;
      crossings[k] = nd > 0 ? t : std::numeric_limits<Real>::infinity();
    }
    for (uint32_t k = 0; k < count; ++k) {
      const Real t = crossings[k];
      second = std::min(second, std::max(exit.t, t));
      exit.edge = t < exit.t ? chunk + k : exit.edge;
      exit.t = std::min(exit.t, t);
    }
  }
  if (exit.edge == kNoEdge) return exit;

  // A crossing is exact to about epsilon (|r| + |n|) |n| / (n.d). The next one must be farther off,
  // or the order of the two is not known: sites hardly apart have the same faces, and the wrong
  // half of such a pair would lead the ray astray by more than their distance. And n.d must be more
  // than its own rounding, or its sign is not known.
  const FacePlane<Real>& plane = geometry.planes[exit.edge];
  const Real nd = plane.normal.dot(direction);
  const Real squared_length = 2 * plane.half_squared;
  const Real gap = (second - exit.t) * nd;
  constexpr Real kRounding = 4 * std::numeric_limits<Real>::epsilon();
  if (gap * gap > kRounding * kRounding * (r.squaredNorm() + plane.half_squared) * squared_length &&
      nd * nd > Real(1e-10) * squared_length) {
    return exit;
  }
  return FindExitInDouble(geometry, cell, origin, direction);
}

// Walks from `start`, the cell whose site is nearest to `origin`, calling
//   visit(cell, t_in, t_out, edge, clamped) -> bool: go on?
// for every cell that the ray leaves again: [t_in, t_out] is its piece of the ray, `edge` the exit
// face. clamped: the exit lay before the entry (rounding, or a topology older than the positions),
// so t_out = t_in, and the face has no say in it. The last, unbounded cell (a guard's) is not
// visited. Returns false if the walk was cut by the step limit, which never happens: no cell is
// visited twice, and the limit is the number of cells.
template <typename Real, typename Visitor>
bool Walk(const WalkGeometry<Real>& geometry,
          const Eigen::Matrix<Real, 3, 1>& origin,
          const Eigen::Matrix<Real, 3, 1>& direction,
          uint32_t start,
          Visitor&& visit) {
  const Delaunay& delaunay = *geometry.delaunay;
  uint32_t cell = start;
  Real t_in = 0;
  for (uint32_t step = 0; step <= delaunay.num_cells; ++step) {
    const CellExit<Real> exit = FindExit(geometry, cell, origin, direction);
    if (exit.edge == kNoEdge) return true;
    const bool clamped = exit.t < t_in;
    const Real t_out = clamped ? t_in : exit.t;
    if (!visit(cell, t_in, t_out, exit.edge, clamped)) return true;
    t_in = t_out;
    cell = delaunay.neighbors[exit.edge];
  }
  return false;
}

// Sets positions and planes for `cell_positions` (guards included); also after sites have moved on
// an unchanged topology.
template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             const Delaunay& delaunay,
             WalkGeometry<Real>* geometry);

extern template void Refresh(const std::vector<Eigen::Vector3f>&,
                             const Delaunay&,
                             WalkGeometry<float>*);
extern template void Refresh(const std::vector<Eigen::Vector3d>&,
                             const Delaunay&,
                             WalkGeometry<double>*);

}  // namespace semfoam
