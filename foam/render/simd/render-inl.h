// SPDX-License-Identifier: GPL-3.0-or-later
//
// TraceRay and BackpropagateRay (ray_record.h) with vector instructions. Compiled once per
// instruction set (foam/render/simd/kernels.cc), hence the guard that toggles.
#if defined(SEMFOAM_SIMD_RENDER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SEMFOAM_SIMD_RENDER_INL_H_
#undef SEMFOAM_SIMD_RENDER_INL_H_
#else
#define SEMFOAM_SIMD_RENDER_INL_H_
#endif

#include "foam/render/ray_tracer.h"
#include "foam/render/simd/walk-inl.h"

#include <algorithm>
#include <cmath>

#include <hwy/cache_control.h>
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace semfoam {
namespace HWY_NAMESPACE {

// Resizes the arrays for `count` segments, the entry behind the last one, and a register's width of
// padding.
inline void Reserve(size_t count, RayTrace* ray) {
  if (ray->segments.size() >= count + 1 + kPlaneLanes) return;
  const size_t size = std::max<size_t>(2 * count, 128) + 1 + kPlaneLanes;
  ray->sites.resize(size);
  ray->segments.resize(size);
  ray->weight.resize(size);
  ray->transmittance.resize(size);
  for (auto& channel : ray->color) channel.resize(size);
  ray->centroid.resize(size);
  for (auto& channel : ray->slope) channel.resize(size);
}

// Prefetches the data of a cell in two stages: first the arrays indexed by the cell, then the
// planes at the offset that those hold. Reading the offset at once would stall, for a fifth of the
// walk's time in a foam larger than the caches.
inline void PrefetchCell(const WalkGeometry<float>& geometry,
                         const CellShading<float>& shading,
                         uint32_t cell) {
  hwy::Prefetch(&geometry.positions[cell]);
  hwy::Prefetch(&shading.density[cell]);
  hwy::Prefetch(&geometry.first_block[cell]);
}

inline void PrefetchPlanes(const WalkGeometry<float>& geometry, uint32_t cell) {
  const auto* const block =
      reinterpret_cast<const char*>(geometry.blocks.data() + geometry.first_block[cell]);
  for (size_t line = 0; line < sizeof(PlaneBlock<float>); line += 64) hwy::Prefetch(block + line);
}

// Prefetches a cell's colour and identity. kLocality is that of __builtin_prefetch: 3 brings the
// lines to the first-level cache, 2 to the second.
template <int kLocality>
HWY_INLINE void PrefetchAppearance(const CellShading<float>& shading,
                                   size_t sh_stride,
                                   size_t cell) {
  const float* const sh = shading.sh + cell * sh_stride;
  for (size_t k = 0; k < sh_stride; k += 16) __builtin_prefetch(sh + k, 0, kLocality);
  __builtin_prefetch(sh + sh_stride - 1, 0, kLocality);
  if (shading.identity != nullptr) {
    __builtin_prefetch(shading.identity + cell * kIdentityDim, 0, kLocality);
  }
  if (shading.color_gradient != nullptr) {
    const float* const gradient = shading.color_gradient + cell * kColorGradientDim;
    __builtin_prefetch(gradient, 0, kLocality);
    __builtin_prefetch(gradient + kColorGradientDim - 1, 0, kLocality);
  }
}

// The state of a ray that walks.
struct WalkState {
  uint32_t cell;
  float t;    // distance at which the ray entered the cell
  float tau;  // optical depth up to there
  bool alive;
};

// Writes the entry behind the last segment: the cell in which the ray ends.
HWY_INLINE void RecordEnd(const WalkGeometry<float>& geometry,
                          const WalkState& state,
                          RayTrace* ray) {
  const size_t k = ray->num_segments;
  const Eigen::Vector3f& site = geometry.positions[state.cell];
  ray->sites[k] = {site[0], site[1], site[2], 0};
  ray->segments[k] = {state.cell, 0, state.tau, 0};
}

// Walks a ray through its cell, records the segment and prefetches the next cell. Returns false
// where the ray ends: without an exit, or behind the segment at which it passes `cutoff_tau`.
HWY_INLINE bool StepAndRecord(const WalkGeometry<float>& geometry,
                              const CellShading<float>& shading,
                              size_t sh_stride,
                              float cutoff_tau,
                              WalkState* state,
                              RayTrace* ray) {
  const CellExit<float> exit = FindExitSimd(geometry, state->cell, ray->origin, ray->direction);
  if (HWY_UNLIKELY(exit.neighbor == kNoCell)) {
    RecordEnd(geometry, *state, ray);
    return false;
  }
  const size_t k = ray->num_segments;
  const Eigen::Vector3f& site = geometry.positions[state->cell];
  if (HWY_UNLIKELY(exit.t < state->t)) ray->clamped.push_back(static_cast<uint32_t>(k));
  const float t_out = HWY_MAX(exit.t, state->t);
  const float sigma = shading.density[state->cell];
  const float shaded = sigma > static_cast<float>(kTransparentDensity) ? sigma : 0.f;
  const float optical_depth = shaded * (t_out - state->t);
  ray->sites[k] = {site[0], site[1], site[2], t_out > state->t ? shaded : 0.f};
  ray->segments[k] = {state->cell, t_out, state->tau, optical_depth};
  ++ray->num_segments;
  // Prefetches the next cell while the other rays compute, and the data for shading while the walk
  // continues: into the second-level cache, because the first-level cache cannot hold the cells of
  // all these rays.
  PrefetchCell(geometry, shading, exit.neighbor);
  if (optical_depth > kNegligibleWeight) {
    PrefetchAppearance<2>(shading, sh_stride, state->cell);
  } else if (shaded > 0) {
    __builtin_prefetch(shading.sh + state->cell * sh_stride, 0, 2);
  }
  state->tau += optical_depth;
  state->t = t_out;
  state->cell = exit.neighbor;
  if (HWY_UNLIKELY(ray->segments.size() < k + 2 + kPlaneLanes)) Reserve(k + 1, ray);
  if (HWY_UNLIKELY(!(state->tau < cutoff_tau))) {
    RecordEnd(geometry, *state, ray);
    return false;
  }
  return true;
}

// Walks a group of rays in turns. Shades nothing: the walk needs the optical depth only, to know
// where to stop.
template <int kRays>
void WalkAndRecord(const WalkGeometry<float>& geometry,
                   const CellShading<float>& shading,
                   float cutoff_tau,
                   RayTrace* rays) {
  WalkState states[kRays];
  for (int r = 0; r < kRays; ++r) {
    states[r] = {rays[r].start_cell, 0, 0, true};
    rays[r].num_segments = 0;
    rays[r].hit_step_limit = false;
    rays[r].clamped.clear();
    Reserve(1, &rays[r]);
  }
  const size_t sh_stride = 3 * NumShCoefficients(shading.sh_degree);
  const size_t limit = geometry.positions.size();
  int num_alive = kRays;
  for (size_t step = 0; step <= limit && num_alive > 0; ++step) {
    for (int r = 0; r < kRays; ++r) {
      // Prefetches the planes for the ray whose turn comes after half of the others.
      if (const WalkState& later = states[(r + kRays / 2) % kRays]; kRays > 1 && later.alive) {
        PrefetchPlanes(geometry, later.cell);
      }
      WalkState& state = states[r];
      if (!state.alive) continue;
      if (!StepAndRecord(geometry, shading, sh_stride, cutoff_tau, &state, &rays[r])) {
        state.alive = false;
        --num_alive;
      }
    }
  }
  for (int r = 0; r < kRays; ++r) rays[r].hit_step_limit = states[r].alive;
}

#if HWY_TARGET != HWY_SCALAR
// Three channels in a register; the fourth lane is ignored.
using ChannelTag = hn::CappedTag<float, 4>;
using Channels = hn::Vec<ChannelTag>;

// Loads the last row of three floats of an array: there may be no float behind it, but there is one
// before it.
HWY_INLINE Channels LoadLastRow(const float* row) {
  return hn::Shuffle0321(hn::LoadU(ChannelTag(), row - 1));
}

// Computes 0.5 + sum of basis[k] * sh[k]. `sh` is [num_coefficients][3], and there is a float
// behind the first three. Two sums, because the multiply-adds of one sum depend on each other.
HWY_INLINE Channels ShSum(const float* basis, int num_coefficients, const float* sh) {
  const ChannelTag f;
  auto even = hn::MulAdd(hn::Set(f, basis[0]), hn::LoadU(f, sh), hn::Set(f, 0.5f));
  if (num_coefficients == 1) return even;
  const int last = num_coefficients - 1;
  auto odd = hn::Zero(f);
  int k = 1;
  for (; k + 1 < last; k += 2) {
    odd = hn::MulAdd(hn::Set(f, basis[k]), hn::LoadU(f, sh + 3 * k), odd);
    even = hn::MulAdd(hn::Set(f, basis[k + 1]), hn::LoadU(f, sh + 3 * k + 3), even);
  }
  if (k < last) odd = hn::MulAdd(hn::Set(f, basis[k]), hn::LoadU(f, sh + 3 * k), odd);
  return hn::Add(hn::MulAdd(hn::Set(f, basis[last]), LoadLastRow(sh + 3 * last), even), odd);
}

// Writes the first three lanes.
HWY_INLINE void StoreChannels(Channels channels, float* out) {
  HWY_ALIGN float lanes[4];
  hn::Store(channels, ChannelTag(), lanes);
  std::copy_n(lanes, 3, out);
}
#endif

// Computes ShColor with the three channels in a register. Conditions as for ShSum.
HWY_INLINE void ShColorSimd(const float* basis,
                            int num_coefficients,
                            const float* sh,
                            float* color) {
#if HWY_TARGET == HWY_SCALAR
  ShColor(basis, num_coefficients, sh, color);
#else
  const Channels sum = ShSum(basis, num_coefficients, sh);
  StoreChannels(hn::Max(sum, hn::Zero(ChannelTag())), color);
#endif
}

// Computes LinearColor with the three channels in a register. Of a single coefficient, `sh` need
// not have a float behind it.
HWY_INLINE void LinearColorSimd(const float* basis,
                                int num_coefficients,
                                const float* sh,
                                const float* gradient,
                                const Eigen::Vector3f& offset,
                                const Eigen::Vector3f& direction,
                                float* color,
                                float* slope) {
#if HWY_TARGET == HWY_SCALAR
  LinearColor(basis, num_coefficients, sh, gradient, offset, direction, color, slope);
#else
  const ChannelTag f;
  Channels sum;
  if (num_coefficients == 1) {
    HWY_ALIGN float constant[4] = {};
    for (int c = 0; c < 3; ++c) constant[c] = 0.5f + basis[0] * sh[c];
    sum = hn::Load(f, constant);
  } else {
    sum = ShSum(basis, num_coefficients, sh);
  }
  const auto x = hn::LoadU(f, gradient), y = hn::LoadU(f, gradient + 3);
  const auto z = LoadLastRow(gradient + 6);
  sum = hn::MulAdd(hn::Set(f, offset[0]), x, sum);
  sum = hn::MulAdd(hn::Set(f, offset[1]), y, sum);
  sum = hn::MulAdd(hn::Set(f, offset[2]), z, sum);
  auto along = hn::Mul(hn::Set(f, direction[0]), x);
  along = hn::MulAdd(hn::Set(f, direction[1]), y, along);
  along = hn::MulAdd(hn::Set(f, direction[2]), z, along);
  const auto zero = hn::Zero(f);
  StoreChannels(hn::IfThenElseZero(hn::Gt(sum, zero), along), slope);
  StoreChannels(hn::Max(sum, zero), color);
#endif
}

// Computes CentroidShare of an optical depth x, of which `absorbed` is 1 - exp(-x).
HWY_INLINE Floats CentroidShareSimd(Floats x, Floats absorbed) {
  const FloatTag f;
  const Floats one = hn::Set(f, 1.f);
  const Floats xx = hn::Mul(x, x);
  Floats series = hn::Set(f, -1.f / 1209600);
  series = hn::MulAdd(series, xx, hn::Set(f, 1.f / 30240));
  series = hn::NegMulAdd(series, xx, hn::Set(f, 1.f / 720));
  series = hn::NegMulAdd(series, xx, hn::Set(f, 1.f / 12));
  const Floats thin = hn::NegMulAdd(series, x, hn::Set(f, 0.5f));
  // 1 / (exp(x) - 1) = exp(-x) / absorbed.
  const Floats thick = hn::Sub(hn::Div(one, x), hn::Div(hn::Sub(one, absorbed), absorbed));
  return hn::IfThenElse(hn::Lt(x, hn::Set(f, 0.5f)), thin, thick);
}

// Computes CentroidShareDerivative likewise.
HWY_INLINE Floats CentroidShareDerivativeSimd(Floats x, Floats absorbed) {
  const FloatTag f;
  const Floats one = hn::Set(f, 1.f);
  const Floats xx = hn::Mul(x, x);
  Floats series = hn::Set(f, 1.f / 172800);
  series = hn::NegMulAdd(series, xx, hn::Set(f, 1.f / 6048));
  series = hn::NegMulAdd(series, xx, hn::Set(f, 1.f / 240));
  series = hn::NegMulAdd(series, xx, hn::Set(f, 1.f / 12));
  const Floats thick =
      hn::Sub(hn::Div(hn::Sub(one, absorbed), hn::Mul(absorbed, absorbed)), hn::Div(one, xx));
  return hn::IfThenElse(hn::Lt(x, hn::Set(f, 0.5f)), hn::Neg(series), thick);
}

// Computes the segments' weights, and the transmittance behind each. `with_centroids`: also the
// centroids of the weights.
HWY_INLINE void ComputeWeights(bool with_centroids, RayTrace* ray) {
  const FloatTag f;
  constexpr size_t kStep = hn::MaxLanes(f);
  const size_t n = ray->num_segments;
  // Pads the last entry with entries of depth 0, so that whole registers can be processed.
  std::fill_n(&ray->segments[n + 1], kPlaneLanes - 1, ray->segments[n]);
  std::fill_n(&ray->sites[n + 1], kPlaneLanes - 1, ray->sites[n]);
  for (size_t k = 0; k < n; k += kStep) {
    Floats cell, t_out, tau_in, optical_depth;
    hn::LoadInterleaved4(
        f, reinterpret_cast<const float*>(&ray->segments[k]), cell, t_out, tau_in, optical_depth);
    const Floats before = hn::Exp(f, hn::Neg(tau_in));
    const Floats through = hn::Exp(f, hn::Neg(hn::Add(tau_in, optical_depth)));
    const Floats absorbed = hn::Neg(hn::Expm1(f, hn::Neg(optical_depth)));
    hn::StoreU(hn::Mul(before, absorbed), f, ray->weight.data() + k);
    hn::StoreU(through, f, ray->transmittance.data() + k);
    if (!with_centroids) continue;
    // The share first, in place of the centroid.
    hn::StoreU(CentroidShareSimd(optical_depth, absorbed), f, ray->centroid.data() + k);
  }
  if (!with_centroids) return;
  float t_in = 0;
  for (size_t k = 0; k < n; ++k) {
    const float t_out = ray->segments[k].t_out;
    ray->centroid[k] = t_in + (t_out - t_in) * ray->centroid[k];
    t_in = t_out;
  }
}

// Sets the composite's depth quantiles, from its optical depth.
HWY_INLINE void FindQuantiles(RayTrace* ray) {
  RayComposite<float>& composite = ray->composite;
  for (int q = 0; q < kNumQuantiles; ++q) {
    const float quantile = ray->quantile_tau[q];
    composite.quantile_tau[q] = quantile;
    if (!(quantile < composite.tau)) continue;
    size_t k = 0;
    while (!(quantile < ray->segments[k + 1].tau_in)) ++k;
    const RayTrace::Segment& segment = ray->segments[k];
    const float t_in = k == 0 ? 0.f : ray->segments[k - 1].t_out;
    const float depth = t_in + (quantile - segment.tau_in) / ray->sites[k].density;
    composite.quantile_segment[q] = static_cast<int>(k);
    composite.quantile_depth[q] = depth < segment.t_out ? depth : segment.t_out;
  }
}

// Computes the segments' colours, and adds their colours and identities to the composite.
HWY_INLINE void AddAppearance(const CellShading<float>& shading, RayTrace* ray) {
  RayComposite<float>& composite = ray->composite;
  const size_t n = ray->num_segments;
  const int num_coefficients = NumShCoefficients(shading.sh_degree);
  ShBasis(shading.sh_degree, ray->direction, ray->sh_basis);
  const hn::CappedTag<float, kIdentityDim> id;
  constexpr size_t kIdStep = hn::MaxLanes(id);
  constexpr size_t kIdParts = kIdentityDim / kIdStep;
  hn::Vec<decltype(id)> identity[kIdParts];
  for (auto& part : identity) part = hn::Zero(id);
  constexpr size_t kAhead = 4;  // segments, from the second-level cache to the first
  for (size_t k = 0; k < n; ++k) {
    float color[3] = {0, 0, 0};
    float slope[3] = {0, 0, 0};
    if (k + kAhead < n && ray->weight[k + kAhead] > kNegligibleWeight) {
      PrefetchAppearance<3>(shading, 3 * num_coefficients, ray->segments[k + kAhead].cell);
    }
    if (ray->sites[k].density > 0) {
      const float weight = ray->weight[k];
      const size_t cell = ray->segments[k].cell;
      const bool counts = weight > kNegligibleWeight;
      const float* const sh = shading.sh + cell * 3 * num_coefficients;
      if (counts && shading.color_gradient != nullptr) {
        const RayTrace::Site& site = ray->sites[k];
        LinearColorSimd(ray->sh_basis,
                        num_coefficients,
                        sh,
                        shading.color_gradient + cell * kColorGradientDim,
                        ray->origin + ray->centroid[k] * ray->direction -
                            Eigen::Vector3f(site.x, site.y, site.z),
                        ray->direction,
                        color,
                        slope);
      } else if (num_coefficients == 1) {
        ShColor(ray->sh_basis, 1, sh, color);
      } else {
        ShColorSimd(ray->sh_basis, counts ? num_coefficients : 1, sh, color);
      }
      for (int c = 0; c < 3; ++c) composite.color[c] += weight * color[c];
      if (counts && shading.identity != nullptr) {
        const float* const row = shading.identity + cell * kIdentityDim;
        const auto w = hn::Set(id, weight);
        for (size_t p = 0; p < kIdParts; ++p) {
          identity[p] = hn::MulAdd(w, hn::LoadU(id, row + p * kIdStep), identity[p]);
        }
      }
    }
    for (int c = 0; c < 3; ++c) ray->color[c][k] = color[c];
    if (!ray->has_slopes) continue;
    for (int c = 0; c < 3; ++c) ray->slope[c][k] = slope[c];
  }
  for (size_t p = 0; p < kIdParts; ++p) {
    hn::StoreU(identity[p], id, composite.identity + p * kIdStep);
  }
}

// Computes weights, depth quantiles, colour and identity of a walked ray.
inline void ShadeRay(const CellShading<float>& shading, RayTrace* ray) {
  ray->has_slopes = shading.color_gradient != nullptr;
  ComputeWeights(ray->has_slopes, ray);
  ray->composite = {};
  ray->composite.tau = ray->segments[ray->num_segments].tau_in;
  FindQuantiles(ray);
  AddAppearance(shading, ray);
}

void TraceRays(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               float cutoff_tau,
               RayTrace* rays,
               size_t count) {
  size_t i = 0;
  for (; i + kRaysInFlight <= count; i += kRaysInFlight) {
    WalkAndRecord<kRaysInFlight>(geometry, shading, cutoff_tau, rays + i);
    for (int r = 0; r < kRaysInFlight; ++r) ShadeRay(shading, &rays[i + r]);
  }
  for (; i < count; ++i) {
    WalkAndRecord<1>(geometry, shading, cutoff_tau, rays + i);
    ShadeRay(shading, &rays[i]);
  }
}

// Scratch of the backward pass, one per thread.
struct BackwardScratch {
  LargePageVector<float> by_weight;    // dL/dw
  LargePageVector<float> behind;       // sum over the segments behind of w dL/dw, and of quantiles
  LargePageVector<float> density;      // dL/dsigma
  LargePageVector<float> by_t;         // dL/dt of the exit face
  LargePageVector<float> by_t_own;     // the part of it that comes from the segment before the face
  LargePageVector<float> by_centroid;  // dL/dt of the centroid of the segment's weight
  LargePageVector<float> here[3];      // by_t dt/d(site of the segment)
  LargePageVector<float> beyond[3];    // by_t dt/d(site behind the face)

  void Reserve(size_t count) {
    if (density.size() >= count) return;
    for (auto* array : {&by_weight, &behind, &density, &by_t, &by_t_own, &by_centroid}) {
      array->resize(2 * count);
    }
    for (auto& array : here) array.resize(2 * count);
    for (auto& array : beyond) array.resize(2 * count);
  }
};

// Adds the identity's share to dL/dw of the segments that show their identity, and what that adds
// to the suffix sum to `behind`.
inline void AddIdentityByWeight(const RayTrace& ray,
                                const float* identity_gradient,
                                const float* identity,
                                BackwardScratch* s) {
  const hn::CappedTag<float, kIdentityDim> id;
  constexpr size_t kStep = hn::MaxLanes(id);
  constexpr size_t kParts = kIdentityDim / kStep;
  hn::Vec<decltype(id)> gradient[kParts];
  for (size_t p = 0; p < kParts; ++p) gradient[p] = hn::LoadU(id, identity_gradient + p * kStep);
  for (int k = 0; k < ray.num_segments; ++k) {
    const float weight = ray.weight[k];
    if (!(weight > kNegligibleWeight)) continue;
    const float* const row = identity + size_t{ray.segments[k].cell} * kIdentityDim;
    auto sum = hn::Mul(gradient[0], hn::LoadU(id, row));
    for (size_t p = 1; p < kParts; ++p) {
      sum = hn::MulAdd(gradient[p], hn::LoadU(id, row + p * kStep), sum);
    }
    const float by_weight = hn::GetLane(hn::SumOfLanes(id, sum));
    s->by_weight[k] += by_weight;
    s->behind[k] += by_weight * weight;
  }
}

// Computes dL/dw, and what each segment adds to the suffix sum of those before it.
HWY_INLINE void BackpropagateToWeights(const RayTrace& ray,
                                       const RayGradient<float>& gradient,
                                       const float* identity,
                                       BackwardScratch* s) {
  const FloatTag f;
  constexpr size_t kStep = hn::MaxLanes(f);
  const size_t n = ray.num_segments;
  const Floats opacity = hn::Set(f, gradient.opacity);
  const Floats red = hn::Set(f, gradient.color[0]);
  const Floats green = hn::Set(f, gradient.color[1]);
  const Floats blue = hn::Set(f, gradient.color[2]);
  for (size_t k = 0; k < n; k += kStep) {
    const Floats by_weight =
        hn::MulAdd(red,
                   hn::LoadU(f, ray.color[0].data() + k),
                   hn::MulAdd(green,
                              hn::LoadU(f, ray.color[1].data() + k),
                              hn::MulAdd(blue, hn::LoadU(f, ray.color[2].data() + k), opacity)));
    hn::StoreU(by_weight, f, s->by_weight.data() + k);
    hn::StoreU(hn::Mul(by_weight, hn::LoadU(f, ray.weight.data() + k)), f, s->behind.data() + k);
  }
  if (identity != nullptr) AddIdentityByWeight(ray, gradient.identity, identity, s);
  for (int q = 0; q < kNumQuantiles; ++q) {
    const int k = ray.composite.quantile_segment[q];
    if (k >= 0) s->behind[k] += gradient.quantile_depth[q] / ray.sites[k].density;
  }
}

// Replaces what each segment adds to the suffix sum by the sum over the segments behind it.
HWY_INLINE void SumBehind(size_t num_segments, BackwardScratch* s) {
  float suffix = 0;
  for (size_t k = num_segments; k-- > 0;) {
    const float own = s->behind[k];
    s->behind[k] = suffix;
    suffix += own;
  }
}

// Adds what the gradients of the colours do by moving the centroids: to the densities and to
// by_t_own, so that a segment's exit gains and its entry loses it. Writes dL/dcentroid, by which
// the entry gains in addition, to by_centroid.
HWY_INLINE void BackpropagateToCentroids(const RayTrace& ray,
                                         const RayGradient<float>& gradient,
                                         BackwardScratch* s) {
  const FloatTag f;
  constexpr size_t kStep = hn::MaxLanes(f);
  const size_t n = ray.num_segments;
  const Floats zero = hn::Zero(f);
  const Floats red = hn::Set(f, gradient.color[0]);
  const Floats green = hn::Set(f, gradient.color[1]);
  const Floats blue = hn::Set(f, gradient.color[2]);
  for (size_t k = 0; k < n; k += kStep) {
    Floats x, y, z, density, cell, t_out, tau_in, optical_depth;
    hn::LoadInterleaved4(f, reinterpret_cast<const float*>(&ray.sites[k]), x, y, z, density);
    hn::LoadInterleaved4(
        f, reinterpret_cast<const float*>(&ray.segments[k]), cell, t_out, tau_in, optical_depth);
    const Floats by_color =
        hn::MulAdd(red,
                   hn::LoadU(f, ray.slope[0].data() + k),
                   hn::MulAdd(green,
                              hn::LoadU(f, ray.slope[1].data() + k),
                              hn::Mul(blue, hn::LoadU(f, ray.slope[2].data() + k))));
    const Floats by_centroid = hn::IfThenElse(
        hn::Gt(density, zero), hn::Mul(by_color, hn::LoadU(f, ray.weight.data() + k)), zero);
    const Floats absorbed = hn::Neg(hn::Expm1(f, hn::Neg(optical_depth)));
    const Floats derivative = CentroidShareDerivativeSimd(optical_depth, absorbed);
    const Floats by_length =
        hn::MulAdd(optical_depth, derivative, CentroidShareSimd(optical_depth, absorbed));
    const Floats length = hn::Div(optical_depth, density);
    const Floats by_density = hn::Mul(by_centroid, hn::Mul(hn::Mul(length, length), derivative));
    const auto has_slope = hn::Ne(by_centroid, zero);
    const auto add = [&](Floats value, float* to) HWY_ATTR {
      hn::StoreU(hn::Add(hn::LoadU(f, to), hn::IfThenElse(has_slope, value, zero)), f, to);
    };
    add(by_density, s->density.data() + k);
    add(hn::Mul(by_centroid, by_length), s->by_t_own.data() + k);
    hn::StoreU(by_centroid, f, s->by_centroid.data() + k);
  }
}

// Computes dL/dx, and from it the gradients of the densities and of the faces' distances.
HWY_INLINE void BackpropagateToDensities(const RayTrace& ray,
                                         const RayGradient<float>& gradient,
                                         BackwardScratch* s) {
  const FloatTag f;
  constexpr size_t kStep = hn::MaxLanes(f);
  const size_t n = ray.num_segments;
  const Floats zero = hn::Zero(f);
  for (size_t k = 0; k < n; k += kStep) {
    Floats x, y, z, density, cell, t_out, tau_in, optical_depth;
    hn::LoadInterleaved4(f, reinterpret_cast<const float*>(&ray.sites[k]), x, y, z, density);
    hn::LoadInterleaved4(
        f, reinterpret_cast<const float*>(&ray.segments[k]), cell, t_out, tau_in, optical_depth);
    const Floats by_depth = hn::Sub(
        hn::Mul(hn::LoadU(f, s->by_weight.data() + k), hn::LoadU(f, ray.transmittance.data() + k)),
        hn::LoadU(f, s->behind.data() + k));
    const Floats by_density = hn::Div(hn::Mul(by_depth, optical_depth), density);
    hn::StoreU(hn::IfThenElse(hn::Gt(density, zero), by_density, zero), f, s->density.data() + k);
    hn::StoreU(hn::Mul(by_depth, density), f, s->by_t_own.data() + k);
  }
  if (ray.has_slopes) BackpropagateToCentroids(ray, gradient, s);
  for (size_t k = n; k < n + kStep; ++k) s->by_t_own[k] = 0;
  for (size_t k = 0; k < n; k += kStep) {
    hn::StoreU(
        hn::Sub(hn::LoadU(f, s->by_t_own.data() + k), hn::LoadU(f, s->by_t_own.data() + k + 1)),
        f,
        s->by_t.data() + k);
  }
  const RayComposite<float>& composite = ray.composite;
  for (int q = 0; q < kNumQuantiles; ++q) {
    const int k = composite.quantile_segment[q];
    if (k < 0) continue;
    const float by_quantile = gradient.quantile_depth[q];
    const float t_in = k == 0 ? 0.f : ray.segments[k - 1].t_out;
    s->density[k] -= by_quantile * (composite.quantile_depth[q] - t_in) / ray.sites[k].density;
    if (k > 0) s->by_t[k - 1] += by_quantile;
  }
  if (ray.has_slopes) {
    // What the segment behind a face does to its centroid by its entry.
    for (size_t k = 1; k < n; ++k) s->by_t[k - 1] += s->by_centroid[k];
  }
  // A clamped exit has the entry's distance, so its gradient is added to the entry's.
  for (size_t i = ray.clamped.size(); i-- > 0;) {
    const uint32_t k = ray.clamped[i];
    if (k > 0) s->by_t[k - 1] += s->by_t[k];
    s->by_t[k] = 0;
  }
}

// Computes the gradients of the sites on both sides of each face: CrossingDerivatives and IsGrazing
// of walk.h as vector code.
HWY_INLINE void BackpropagateToSites(const RayTrace& ray, BackwardScratch* s) {
  const FloatTag f;
  constexpr size_t kStep = hn::MaxLanes(f);
  const size_t n = ray.num_segments;
  const Floats zero = hn::Zero(f);
  const Floats dx = hn::Set(f, ray.direction[0]);
  const Floats dy = hn::Set(f, ray.direction[1]);
  const Floats dz = hn::Set(f, ray.direction[2]);
  const Floats ox = hn::Set(f, ray.origin[0]);
  const Floats oy = hn::Set(f, ray.origin[1]);
  const Floats oz = hn::Set(f, ray.origin[2]);
  const Floats grazing = hn::Set(f, 1e-10f);
  for (size_t k = 0; k < n; k += kStep) {
    Floats x, y, z, nx, ny, nz, density, cell, t, tau_in, optical_depth;
    hn::LoadInterleaved4(f, reinterpret_cast<const float*>(&ray.sites[k]), x, y, z, density);
    hn::LoadInterleaved4(f, reinterpret_cast<const float*>(&ray.sites[k + 1]), nx, ny, nz, density);
    hn::LoadInterleaved4(
        f, reinterpret_cast<const float*>(&ray.segments[k]), cell, t, tau_in, optical_depth);
    nx = hn::Sub(nx, x);
    ny = hn::Sub(ny, y);
    nz = hn::Sub(nz, z);
    const Floats nd = hn::MulAdd(nx, dx, hn::MulAdd(ny, dy, hn::Mul(nz, dz)));
    const Floats nn = hn::MulAdd(nx, nx, hn::MulAdd(ny, ny, hn::Mul(nz, nz)));
    const auto is_constant = hn::Lt(hn::Mul(nd, nd), hn::Mul(grazing, nn));
    const Floats by_t = hn::LoadU(f, s->by_t.data() + k);
    const Floats scale =
        hn::IfThenElse(hn::Or(is_constant, hn::Eq(by_t, zero)), zero, hn::Div(by_t, nd));
    const Floats fx = hn::MulAdd(t, dx, hn::Sub(ox, x));
    const Floats fy = hn::MulAdd(t, dy, hn::Sub(oy, y));
    const Floats fz = hn::MulAdd(t, dz, hn::Sub(oz, z));
    hn::StoreU(hn::Mul(scale, fx), f, s->here[0].data() + k);
    hn::StoreU(hn::Mul(scale, fy), f, s->here[1].data() + k);
    hn::StoreU(hn::Mul(scale, fz), f, s->here[2].data() + k);
    hn::StoreU(hn::Mul(scale, hn::Sub(nx, fx)), f, s->beyond[0].data() + k);
    hn::StoreU(hn::Mul(scale, hn::Sub(ny, fy)), f, s->beyond[1].data() + k);
    hn::StoreU(hn::Mul(scale, hn::Sub(nz, fz)), f, s->beyond[2].data() + k);
  }
}

// Appends a record for every cell on the ray that has a gradient, guards apart.
HWY_INLINE void AppendRecords(const RayTrace& ray,
                              const BackwardScratch& s,
                              uint32_t num_sites,
                              uint32_t ray_index,
                              std::vector<GradientRecord>* records) {
  const size_t n = ray.num_segments;
  for (size_t k = 0; k <= n; ++k) {
    GradientRecord record{ray_index, {ray.segments[k].cell, 0, 0, 0, Eigen::Vector3f::Zero(), 0}};
    CellContribution<float>& c = record.contribution;
    if (c.cell >= num_sites) continue;
    if (k > 0) c.position = {s.beyond[0][k - 1], s.beyond[1][k - 1], s.beyond[2][k - 1]};
    if (k < n) {
      c.position += Eigen::Vector3f(s.here[0][k], s.here[1][k], s.here[2][k]);
      c.weight = ray.weight[k];
      c.density = s.density[k];
      if (ray.has_slopes && ray.sites[k].density > 0) c.centroid = ray.centroid[k];
      for (int a = 0; a < 3; ++a) c.color_mask |= uint32_t{ray.color[a][k] > 0} << a;
    }
    if (c.weight == 0 && c.density == 0 && c.position.isZero(0)) continue;
    records->push_back(record);
  }
}

void BackpropagateRay(const RayTrace& ray,
                      const RayGradient<float>& gradient,
                      uint32_t num_sites,
                      uint32_t ray_index,
                      std::vector<GradientRecord>* records,
                      const float* identity) {
  const size_t n = ray.num_segments;
  if (n == 0) return;
  thread_local BackwardScratch s;
  s.Reserve(n + 2 * kPlaneLanes);
  BackpropagateToWeights(ray, gradient, identity, &s);
  SumBehind(n, &s);
  BackpropagateToDensities(ray, gradient, &s);
  BackpropagateToSites(ray, &s);
  AppendRecords(ray, s, num_sites, ray_index, records);
}

// The softmax of all classes is the exponentials divided by `sum`.
struct ClassSoftmax {
  float sum;        // of exp(logit - largest logit)
  float own_logit;  // of the true class, minus the largest
};

// Computes the softmax of an identity's logits. Writes exp(logit - largest logit) of each class to
// `exponentials` [padded_classes].
HWY_INLINE ClassSoftmax ComputeSoftmax(const float* transposed,
                                       const float* padded_bias,
                                       size_t padded_classes,
                                       const float* identity,
                                       int32_t class_index,
                                       float* exponentials) {
  const FloatTag f;
  constexpr size_t kStep = hn::MaxLanes(f);
  Floats largest = hn::Set(f, padded_bias[0]);
  for (size_t k = 0; k < padded_classes; k += kStep) {
    Floats sum = hn::Load(f, padded_bias + k);
    for (int c = 0; c < kIdentityDim; ++c) {
      sum = hn::MulAdd(
          hn::Set(f, identity[c]), hn::Load(f, transposed + c * padded_classes + k), sum);
    }
    hn::Store(sum, f, exponentials + k);  // the logits, for now
    largest = k == 0 ? sum : hn::Max(largest, sum);
  }
  largest = hn::MaxOfLanes(f, largest);
  const float own_logit = exponentials[class_index] - hn::GetLane(largest);
  Floats total = hn::Zero(f);
  for (size_t k = 0; k < padded_classes; k += kStep) {
    const Floats e = hn::Exp(f, hn::Sub(hn::Load(f, exponentials + k), largest));
    hn::Store(e, f, exponentials + k);
    total = hn::Add(total, e);
  }
  return {hn::GetLane(hn::SumOfLanes(f, total)), own_logit};
}

// Computes ClassLoss::Add with the arrays of the class. `exponentials` [padded_classes] is scratch.
float AddClassLoss(const ClassifierView<float>& classifier,
                   const float* transposed,
                   const float* padded_bias,
                   size_t padded_classes,
                   const float* identity,
                   int32_t class_index,
                   float weight,
                   float scale,
                   float* exponentials,
                   float* identity_gradient,
                   float* weight_gradient,
                   float* bias_gradient) {
  const auto [sum, own_logit] =
      ComputeSoftmax(transposed, padded_bias, padded_classes, identity, class_index, exponentials);
  // dL/dlogit = softmax - 1 at the true class.
  const hn::CappedTag<float, kIdentityDim> id;
  constexpr size_t kIdStep = hn::MaxLanes(id);
  constexpr size_t kIdParts = kIdentityDim / kIdStep;
  hn::Vec<decltype(id)> gradient[kIdParts], scaled_identity[kIdParts];
  for (size_t p = 0; p < kIdParts; ++p) {
    gradient[p] = hn::LoadU(id, identity_gradient + p * kIdStep);
    scaled_identity[p] = hn::Mul(hn::Set(id, scale), hn::LoadU(id, identity + p * kIdStep));
  }
  const float normalization = static_cast<float>(ClassNormalization(classifier.num_classes));
  const float per_class = weight / normalization;
  for (int k = 0; k < classifier.num_classes; ++k) {
    const float by_logit =
        per_class * (exponentials[k] / sum - static_cast<float>(k == class_index));
    const auto by = hn::Set(id, by_logit);
    const float* const row = classifier.weight + size_t(k) * kIdentityDim;
    float* const out = weight_gradient + size_t(k) * kIdentityDim;
    for (size_t p = 0; p < kIdParts; ++p) {
      gradient[p] = hn::MulAdd(by, hn::LoadU(id, row + p * kIdStep), gradient[p]);
      hn::StoreU(hn::MulAdd(by, scaled_identity[p], hn::LoadU(id, out + p * kIdStep)),
                 id,
                 out + p * kIdStep);
    }
    bias_gradient[k] += scale * by_logit;
  }
  for (size_t p = 0; p < kIdParts; ++p) {
    hn::StoreU(gradient[p], id, identity_gradient + p * kIdStep);
  }
  return (std::log(sum) - own_logit) / normalization;
}

}  // namespace HWY_NAMESPACE
}  // namespace semfoam
HWY_AFTER_NAMESPACE();

#endif
