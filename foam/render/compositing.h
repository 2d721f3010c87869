// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/util/host_device.h"

#include <cmath>
#include <cstdint>
#include <limits>

// Volume rendering of the segments that a ray cuts out of the cells: in float for work, in double
// and ceres::Jet for tests.
//
// With optical depth x_n = sigma_n (t_out - t_in) of segment n and tau_n that of all segments
// before it, the segment's weight is
//   w_n = exp(-tau_n) (1 - exp(-x_n))                                  (Radiant Foam, equation 2)
// and colour, identity and opacity of the ray are the sums of w_n c_n, w_n f_n and w_n. Where the
// colour of a cell is linear in position, c_n is its value at the centroid of the weight over the
// segment, which is exact (Radiance Meshes, section 4):
//   t_n = t_in + (t_out - t_in) h(x_n),  h(x) = 1 / x - 1 / (exp(x) - 1).
// The backward pass runs over the recorded segments from the far end: with g_n the derivative of
// the loss by w_n,
//   dL/dx_n = g_n exp(-tau_n - x_n) - sum over m > n of g_m w_m,
// a suffix sum; nothing is ever divided by a transmittance, and every segment, the last one too,
// gets its gradient.

namespace semfoam {

// A cell of this density or less is transparent: it adds nothing to a ray and receives no gradient.
// (Normalised frame; 1e-6 over the whole foam, two hundred units across, is an opacity of 2e-4.)
inline constexpr double kTransparentDensity = 1e-6;

// A segment of this weight or less is shaded with the mean colour of its cell, and without
// identity: its higher SH degrees and its feature would not be visible, and reading them costs
// time.
inline constexpr float kNegligibleWeight = 1e-3f;

inline constexpr int kNumQuantiles = 2;

// Returns h(x): where the centroid of a segment's weight lies, as a share of the segment's length;
// 1/2 for a thin segment, 0 for an opaque one. x >= 0. Below 1/2 as a series, because the two terms
// cancel.
template <typename T>
SEMFOAM_HOST_DEVICE T CentroidShare(const T& x) {
  using std::exp;
  using std::expm1;
  if (x < T(0.5)) {
    const T xx = x * x;
    T series = T(1.0 / 30240) - xx * (T(1.0 / 1209600) - xx * T(1.0 / 47900160));
    series = T(1.0 / 12) - xx * (T(1.0 / 720) - xx * series);
    return T(0.5) - x * series;
  }
  // exp(x) would overflow.
  return T(1) / x - exp(-x) / -expm1(-x);
}

// Returns h'(x).
template <typename T>
SEMFOAM_HOST_DEVICE T CentroidShareDerivative(const T& x) {
  using std::exp;
  using std::expm1;
  if (x < T(0.5)) {
    const T xx = x * x;
    T series = T(1.0 / 6048) - xx * (T(1.0 / 172800) - xx * T(1.0 / 5322240));
    series = T(1.0 / 12) - xx * (T(1.0 / 240) - xx * series);
    return -series;
  }
  const T absorbed = -expm1(-x);
  return exp(-x) / (absorbed * absorbed) - T(1) / x / x;
}

// One shaded segment of a ray.
template <typename T>
struct ShadedSegment {
  T t_in;
  T sigma;
  T optical_depth;  // x_n
  T tau_in;         // tau_n
  T weight;         // w_n
  T color[3];       // c_n
  T centroid;       // t_n
  // Derivative of c_n by t_n; 0 where a cell is of one colour.
  T slope[3];
};

// Quantities accumulated along a ray so far.
template <typename T>
struct RayComposite {
  T tau = T(0);
  // Premultiplied colour: sum of w_n c_n.
  T color[3] = {T(0), T(0), T(0)};
  T identity[kIdentityDim] = {};  // sum of w_n f_n
  // Depth quantiles: the distances at which the transmittance falls through q_k =
  // exp(-quantile_tau[k]). A quantile that the ray never reaches has quantile_segment -1.
  T quantile_tau[kNumQuantiles] = {T(std::numeric_limits<double>::infinity()),
                                   T(std::numeric_limits<double>::infinity())};
  T quantile_depth[kNumQuantiles] = {};
  int quantile_segment[kNumQuantiles] = {-1, -1};

  SEMFOAM_HOST_DEVICE T Transmittance() const {
    using std::exp;
    return exp(-tau);
  }
  SEMFOAM_HOST_DEVICE T Opacity() const {
    using std::expm1;
    return -expm1(-tau);
  }
};

// Adds the geometry of segment number `index`: weight, optical depth and any quantile that lies in
// it. The caller adds colour and identity with the weight of the returned segment.
template <typename T>
SEMFOAM_HOST_DEVICE ShadedSegment<T> AddSegment(
    const T& t_in, const T& t_out, const T& sigma, int index, RayComposite<T>* ray) {
  using std::exp;
  using std::expm1;
  ShadedSegment<T> segment;
  segment.t_in = t_in;
  segment.sigma = sigma;
  segment.optical_depth = sigma * (t_out - t_in);
  segment.tau_in = ray->tau;
  segment.weight = exp(-ray->tau) * -expm1(-segment.optical_depth);
  segment.centroid = t_in + (t_out - t_in) * CentroidShare(segment.optical_depth);
  for (int c = 0; c < 3; ++c) segment.slope[c] = T(0);
  const T tau_out = ray->tau + segment.optical_depth;
  for (int k = 0; k < kNumQuantiles; ++k) {
    if (ray->quantile_segment[k] < 0 && ray->quantile_tau[k] < tau_out) {
      ray->quantile_segment[k] = index;
      T depth = t_in + (ray->quantile_tau[k] - ray->tau) / sigma;
      if (!(depth < t_out)) depth = t_out;  // rounding, where sigma is tiny
      ray->quantile_depth[k] = depth;
    }
  }
  ray->tau = tau_out;
  return segment;
}

// Derivatives of the loss by the quantities accumulated along a ray.
template <typename T>
struct RayGradient {
  // By the premultiplied colour.
  T color[3] = {};
  // By 1 - transmittance. Includes the background's share: -(background . gradient of the
  // composited colour).
  T opacity = T(0);
  T quantile_depth[kNumQuantiles] = {};
  T identity[kIdentityDim] = {};
};

// Derivatives of the loss by one segment's own quantities.
template <typename T>
struct SegmentGradient {
  T sigma;
  T t_in;  // not counting what t_in is to the segment before
  T t_out;
};

// Carries the suffix sums from the far end of a ray to its origin: call it for segment n = last,
// ..., 0.
template <typename T>
class BackwardPass {
 public:
  SEMFOAM_HOST_DEVICE BackwardPass(const RayComposite<T>& ray, const RayGradient<T>& gradient)
      : ray_(ray), gradient_(gradient) {}

  // `identity_dot` is the derivative of the loss by w_n through the identity: gradient.identity .
  // f_n, or 0 where the identity loss must not change geometry or the segment is shaded without
  // identity.
  SEMFOAM_HOST_DEVICE SegmentGradient<T> Step(int index,
                                              const ShadedSegment<T>& segment,
                                              const T& identity_dot) {
    using std::exp;
    T by_weight = gradient_.opacity + identity_dot;
    for (int c = 0; c < 3; ++c) by_weight += gradient_.color[c] * segment.color[c];
    const T transmittance_out = exp(-(segment.tau_in + segment.optical_depth));
    T by_optical_depth = by_weight * transmittance_out - suffix_ - quantile_suffix_;
    suffix_ += by_weight * segment.weight;

    const T delta = segment.optical_depth / segment.sigma;
    SegmentGradient<T> out;
    out.t_in = T(0);
    out.sigma = T(0);
    for (int k = 0; k < kNumQuantiles; ++k) {
      if (ray_.quantile_segment[k] != index) continue;
      // depth = t_in + (quantile_tau - tau_in) / sigma
      const T by_depth = gradient_.quantile_depth[k];
      out.t_in += by_depth;
      out.sigma -= by_depth * (ray_.quantile_depth[k] - segment.t_in) / segment.sigma;
      quantile_suffix_ += by_depth / segment.sigma;
    }
    out.sigma += by_optical_depth * delta;
    out.t_out = by_optical_depth * segment.sigma;
    out.t_in -= out.t_out;
    AddCentroid(segment, delta, &out);
    return out;
  }

 private:
  // Adds what the gradient of the colour changes by moving the centroid.
  SEMFOAM_HOST_DEVICE void AddCentroid(const ShadedSegment<T>& segment,
                                       const T& length,
                                       SegmentGradient<T>* out) const {
    T by_centroid = T(0);
    for (int c = 0; c < 3; ++c) by_centroid += gradient_.color[c] * segment.slope[c];
    by_centroid *= segment.weight;
    const T& x = segment.optical_depth;
    const T derivative = CentroidShareDerivative(x);
    const T by_length = CentroidShare(x) + x * derivative;
    out->sigma += by_centroid * length * length * derivative;
    out->t_out += by_centroid * by_length;
    out->t_in += by_centroid * (T(1) - by_length);
  }

  const RayComposite<T>& ray_;
  const RayGradient<T>& gradient_;
  T suffix_ = T(0);           // sum over the segments behind of g_m w_m
  T quantile_suffix_ = T(0);  // sum over the quantiles behind of their gradient / sigma
};

}  // namespace semfoam
