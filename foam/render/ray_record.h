// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/spherical_harmonics.h"
#include "foam/render/compositing.h"
#include "foam/render/walk.h"
#include "foam/util/host_device.h"

#include <cstdint>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

// Casts one ray forward and backward: TraceRay records the walk's segments as it shades them, and
// BackpropagateRay runs over that record. In float and double on the CPU, where it is the reference
// for the fast path (ray_tracer.h), and in float on a GPU, with its own record type
// (foam/device/cuda/segment_pool.h).

namespace semfoam {

inline constexpr int kMaxShCoefficients = 16;

// Densities, colours and identities of all cells. Borrowed; indexed by cell.
template <typename Real>
struct CellShading {
  int sh_degree = 0;
  // [num_cells], after the activation; 0 for the guards.
  const Real* density = nullptr;
  // [num_sites][(sh_degree + 1)^2][3]
  const Real* sh = nullptr;
  // [num_sites][kIdentityDim]; null without semantics.
  const Real* identity = nullptr;
  // [num_sites][3 axes][3 channels]; null where each cell is of one colour (Foam::color_gradient).
  const Real* color_gradient = nullptr;
};

// The part of a ray inside one cell.
template <typename Real>
struct RecordedSegment {
  uint32_t cell;
  // The cell behind the exit face.
  uint32_t next;
  // Index among the ray's shaded segments; -1 where the cell is transparent or the segment has no
  // length.
  int32_t shaded;
  // Whether t_out is the distance of the entry instead of the exit face's (see Walk).
  bool clamped;
  // Distance from the origin at which the ray leaves the cell.
  Real t_out;
};

// A ray in the normalised frame, and the quantities accumulated along it.
template <typename Real>
struct RayInProgress {
  // `direction` has unit length.
  Eigen::Matrix<Real, 3, 1> origin;
  Eigen::Matrix<Real, 3, 1> direction;
  // The SH basis functions in the ray's direction.
  Real sh_basis[kMaxShCoefficients];
  RayComposite<Real> composite;
  // Whether the walk hit the step limit, the number of cells.
  bool hit_step_limit = false;
};

// A ray and its segments, as the backward pass needs them. Reused from ray to ray, so that memory
// is allocated only while the arrays still grow.
template <typename Real>
struct RayRecord : RayInProgress<Real> {
  std::vector<RecordedSegment<Real>> segments;
  std::vector<ShadedSegment<Real>> shaded;

  // Empties the record, for TraceRay.
  void Clear() {
    segments.clear();
    shaded.clear();
  }
  int NumShaded() const { return static_cast<int>(shaded.size()); }
  // Appends a segment. `appearance` is null where it is not shaded. Returns false where there is no
  // more room.
  bool Add(const RecordedSegment<Real>& segment, const ShadedSegment<Real>* appearance) {
    segments.push_back(segment);
    if (appearance != nullptr) shaded.push_back(*appearance);
    return true;
  }

  // For BackpropagateRay: the segments from the far end.
  struct Backwards {
    const RayRecord& record;
    size_t n;

    // Reads the next segment, and its appearance if it is shaded. Returns false where there is
    // none.
    bool Next(RecordedSegment<Real>* segment, ShadedSegment<Real>* appearance) {
      if (n == 0) return false;
      *segment = record.segments[--n];
      if (segment->shaded >= 0) *appearance = record.shaded[segment->shaded];
      return true;
    }
  };
  Backwards FromTheEnd() const { return {*this, segments.size()}; }
};

// A record for TraceRay without a backward pass. Counts the shaded segments only.
template <typename Real>
struct RayWithoutRecord : RayInProgress<Real> {
  int num_shaded = 0;

  SEMFOAM_HOST_DEVICE void Clear() { num_shaded = 0; }
  SEMFOAM_HOST_DEVICE int NumShaded() const { return num_shaded; }
  SEMFOAM_HOST_DEVICE bool Add(const RecordedSegment<Real>&,
                               const ShadedSegment<Real>* appearance) {
    num_shaded += appearance != nullptr;
    return true;
  }
};

// Walks and shades one ray from `start`, the cell nearest to the origin. Stops behind the segment
// at which the optical depth passes `cutoff_tau`, or where the record has no more room. Before, the
// caller sets record->origin, direction, and composite = {} with the quantile_tau that it requests.
template <typename Real, typename Record>
SEMFOAM_HOST_DEVICE void TraceRay(const std::type_identity_t<WalkView<Real>>& geometry,
                                  const CellShading<Real>& shading,
                                  uint32_t start,
                                  std::type_identity_t<Real> cutoff_tau,
                                  Record* record) {
  RayComposite<Real>& composite = record->composite;
  record->Clear();
  const int num_coefficients = NumShCoefficients(shading.sh_degree);
  ShBasis(shading.sh_degree, record->direction, record->sh_basis);
  const auto visit = [&](uint32_t cell, Real t_in, Real t_out, uint32_t next, bool clamped) {
    RecordedSegment<Real> segment;
    segment.cell = cell;
    segment.next = next;
    segment.shaded = -1;
    segment.clamped = clamped;
    segment.t_out = t_out;
    const Real sigma = shading.density[cell];
    if (!(sigma > Real(kTransparentDensity)) || !(t_out > t_in))
      return record->Add(segment, nullptr);

    segment.shaded = record->NumShaded();
    ShadedSegment<Real> shaded = AddSegment(t_in, t_out, sigma, segment.shaded, &composite);
    const bool counts = shaded.weight > Real(kNegligibleWeight);
    const Real* const sh = shading.sh + size_t(cell) * 3 * num_coefficients;
    if (counts && shading.color_gradient != nullptr) {
      const Eigen::Matrix<Real, 3, 1> offset =
          record->origin + shaded.centroid * record->direction - geometry.positions[cell];
      LinearColor(record->sh_basis,
                  num_coefficients,
                  sh,
                  shading.color_gradient + size_t(cell) * kColorGradientDim,
                  offset,
                  record->direction,
                  shaded.color,
                  shaded.slope);
    } else {
      ShColor(record->sh_basis, counts ? num_coefficients : 1, sh, shaded.color);
    }
    for (int c = 0; c < 3; ++c) composite.color[c] += shaded.weight * shaded.color[c];
    if (counts && shading.identity != nullptr) {
      const Real* identity = shading.identity + size_t(cell) * kIdentityDim;
      for (int c = 0; c < kIdentityDim; ++c) {
        composite.identity[c] += shaded.weight * identity[c];
      }
    }
    return record->Add(segment, &shaded) && composite.tau < cutoff_tau;
  };
  record->hit_step_limit = !Walk<Real>(geometry, record->origin, record->direction, start, visit);
}

// One ray's part of one cell's gradient. The gradients of colour and identity are outer products
// with vectors that all cells of the ray share, so the weight is enough: dL/dsh[k][c] = weight *
// gradient.color[c] * sh_basis[k] where bit c of color_mask is set (the channel is not clamped at
// black), dL/df = weight * gradient.identity. Where the weight is negligible (kNegligibleWeight),
// the former holds for k = 0 only and the latter is 0. With the offset of the segment's centroid
// from the site, o + centroid d - p, the same holds of the colour gradient: dL/dgradient[a][c] =
// weight * gradient.color[c] * offset[a]. `position` lacks what the site does to the offset,
// -sum over c of weight * gradient.color[c] * color_gradient[.][c], which is simpler to add once
// for all rays of a cell.
template <typename Real>
struct CellContribution {
  uint32_t cell;
  uint32_t color_mask;
  Real weight;
  // dL/dsigma, by the activated density.
  Real density;
  // dL/dposition, but for the offset's share.
  Eigen::Matrix<Real, 3, 1> position;
  // Distance of the centroid of the segment's weight from the ray's origin.
  Real centroid;
};

// Runs the backward pass and calls emit(CellContribution) for every cell on the ray, guards apart,
// that has a gradient, from the far end to the near one: for the cell behind a segment after that
// segment was read from the record, not before. With `identity` (all cells', as in CellShading)
// gradient.identity flows through the segments' weights into densities and positions, as the
// gradient of the colour does; without it, it stops at the weights.
template <typename Real, typename Record, typename Emit>
SEMFOAM_HOST_DEVICE void BackpropagateRay(const std::type_identity_t<WalkView<Real>>& geometry,
                                          const Record& record,
                                          const RayGradient<Real>& gradient,
                                          Emit&& emit,
                                          const std::type_identity_t<Real>* identity = nullptr) {
  using Vector = Eigen::Matrix<Real, 3, 1>;
  RecordedSegment<Real> segment;
  ShadedSegment<Real> shaded{};
  auto segments = record.FromTheEnd();
  if (!segments.Next(&segment, &shaded)) return;
  BackwardPass<Real> pass(record.composite, gradient);

  const auto emit_if_real = [&](const CellContribution<Real>& contribution) {
    if (contribution.cell >= geometry.num_sites) return;
    if (contribution.weight == 0 && contribution.density == 0 && contribution.position.isZero(0)) {
      return;
    }
    emit(contribution);
  };

  // The cell behind the current face: complete once the face has added its share.
  CellContribution<Real> behind{segment.next, 0, Real(0), Real(0), Vector::Zero(), Real(0)};
  Real by_t_in = 0;  // dL/dt of the current face, as the entry of the cell behind it
  do {
    CellContribution<Real> here{segment.cell, 0, Real(0), Real(0), Vector::Zero(), Real(0)};
    Real by_t_out = by_t_in;
    by_t_in = 0;
    if (segment.shaded >= 0) {
      Real identity_dot(0);
      if (identity != nullptr && shaded.weight > Real(kNegligibleWeight)) {
        for (int c = 0; c < kIdentityDim; ++c) {
          identity_dot += gradient.identity[c] * identity[size_t(segment.cell) * kIdentityDim + c];
        }
      }
      const SegmentGradient<Real> own = pass.Step(segment.shaded, shaded, identity_dot);
      here.weight = shaded.weight;
      here.density = own.sigma;
      here.centroid = shaded.centroid;
      for (int c = 0; c < 3; ++c) here.color_mask |= uint32_t(shaded.color[c] > 0) << c;
      by_t_out += own.t_out;
      by_t_in = own.t_in;
    }
    if (segment.clamped) {
      by_t_in += by_t_out;
    } else if (const Vector n = geometry.positions[segment.next] - geometry.positions[segment.cell];
               by_t_out != 0 && !IsGrazing<Real>(n, record.direction)) {
      const Vector r = record.origin - geometry.positions[segment.cell];
      Vector dt_here, dt_behind;
      CrossingDerivatives<Real>(r, n, record.direction, segment.t_out, &dt_here, &dt_behind);
      here.position += by_t_out * dt_here;
      behind.position += by_t_out * dt_behind;
    }
    emit_if_real(behind);
    behind = here;
  } while (segments.Next(&segment, &shaded));
  emit_if_real(behind);  // the first cell; its entry, t = 0, is the camera's and no site's
}

}  // namespace semfoam
