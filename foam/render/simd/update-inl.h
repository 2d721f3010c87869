// SPDX-License-Identifier: GPL-3.0-or-later
//
// The loops of update_loops.h. Compiled once per instruction set (foam/render/simd/kernels.cc),
// hence the guard that toggles.
#if defined(SEMFOAM_SIMD_UPDATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SEMFOAM_SIMD_UPDATE_INL_H_
#undef SEMFOAM_SIMD_UPDATE_INL_H_
#else
#define SEMFOAM_SIMD_UPDATE_INL_H_
#endif

#include "foam/model/spherical_harmonics.h"
#include "foam/render/update_loops.h"
#include "foam/util/prefetch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace semfoam {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Calls body(tag, k) for lanes [k, k + lanes) of [0, count), with the largest registers that fit.
template <typename Body>
HWY_INLINE void ForLanes(int count, Body&& body) {
  const hn::CappedTag<float, 16> wide;
  const hn::CappedTag<float, 4> narrow;
  const hn::CappedTag<float, 1> single;
  const int wide_step = static_cast<int>(hn::Lanes(wide));
  const int narrow_step = static_cast<int>(hn::Lanes(narrow));
  int k = 0;
  for (; k + wide_step <= count; k += wide_step) body(wide, k);
  for (; k + narrow_step <= count; k += narrow_step) body(narrow, k);
  for (; k < count; ++k) body(single, k);
}

bool AdamStep(const AdamCorrection& correction,
              int count,
              const float* gradient,
              const float* rate,
              float* first_moment,
              float* second_moment,
              float* change) {
  // A value that is not finite makes the sum of squares not finite.
  float squares = 0;
  ForLanes(count, [&](auto f, int k) HWY_ATTR {
    const auto g = hn::LoadU(f, gradient + k);
    squares += hn::GetLane(hn::SumOfLanes(f, hn::Mul(g, g)));
  });
  if (HWY_UNLIKELY(!std::isfinite(squares))) return false;
  ForLanes(count, [&](auto f, int k) HWY_ATTR {
    const auto g = hn::LoadU(f, gradient + k);
    const auto m = hn::MulAdd(hn::Set(f, kAdamBeta1),
                              hn::LoadU(f, first_moment + k),
                              hn::Mul(hn::Set(f, 1 - kAdamBeta1), g));
    const auto v = hn::MulAdd(hn::Set(f, kAdamBeta2),
                              hn::LoadU(f, second_moment + k),
                              hn::Mul(hn::Set(f, 1 - kAdamBeta2), hn::Mul(g, g)));
    hn::StoreU(m, f, first_moment + k);
    hn::StoreU(v, f, second_moment + k);
    const auto step = hn::Mul(hn::LoadU(f, rate + k), hn::Mul(m, hn::Set(f, -correction.first)));
    const auto size =
        hn::Add(hn::Sqrt(hn::Mul(v, hn::Set(f, correction.second))), hn::Set(f, kAdamEpsilon));
    hn::StoreU(hn::Div(step, size), f, change + k);
  });
  return true;
}

void AddTo(const float* change, int count, float* parameters) {
  ForLanes(count, [&](auto f, int k) HWY_ATTR {
    hn::StoreU(hn::Add(hn::LoadU(f, parameters + k), hn::LoadU(f, change + k)), f, parameters + k);
  });
}

// Sums over the records of a cell, per channel (the fourth lane is unused): dL/dcolour, and
// dL/dcolour times the offset of the segment's centroid from the site along each axis. In units of
// kShDc.
struct ColorGradientSums {
  alignas(16) float by_color[4] = {};
  alignas(16) float by_axis[3][4] = {};

  HWY_INLINE void Add(const CellContribution<float>& c,
                      const RayOutput& ray,
                      const float* by_color_of_ray,
                      const Eigen::Vector3f& site) {
    alignas(16) float by[4] = {};
    for (int i = 0; i < 3; ++i) {
      by[i] = c.color_mask >> i & 1 ? c.weight * by_color_of_ray[i] : 0.f;
    }
    const Eigen::Vector3f offset = ray.origin + c.centroid * ray.direction - site;
    ForLanes(4, [&](auto f, int k) HWY_ATTR {
      const auto b = hn::Load(f, by + k);
      hn::Store(hn::Add(hn::Load(f, by_color + k), b), f, by_color + k);
      for (int a = 0; a < 3; ++a) {
        const auto sum = hn::Load(f, by_axis[a] + k);
        hn::Store(hn::MulAdd(hn::Set(f, offset[a]), b, sum), f, by_axis[a] + k);
      }
    });
  }
};

RecordTotals SumRecords(const GradientRecord* records,
                        size_t count,
                        const RayOutput* rays,
                        const ParameterRow& row,
                        const Eigen::Vector3f& site,
                        const float* color_gradient,
                        float* gradient) {
  constexpr size_t kRaysAhead = 3;
  ColorGradientSums sums;
  RecordTotals totals;
  float density = 0;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  for (size_t i = 0; i < count; ++i) {
    if (i + kRaysAhead < count) {
      Prefetch(rays[records[i + kRaysAhead].ray].parameters, row.size * sizeof(float));
    }
    const CellContribution<float>& c = records[i].contribution;
    position += c.position;
    density += c.density;
    if (c.weight == 0) continue;
    totals.largest_weight = std::max(totals.largest_weight, c.weight);
    const float* const shared = rays[records[i].ray].parameters;
    const float* const by_color = shared + row.sh;
    totals.squared_error += c.weight * (by_color[0] * by_color[0] + by_color[1] * by_color[1] +
                                        by_color[2] * by_color[2]);
    const bool counts = c.weight > kNegligibleWeight;
    if (color_gradient != nullptr && counts) sums.Add(c, rays[records[i].ray], by_color, site);
    if (HWY_LIKELY(c.color_mask == 7 && counts)) {
      ForLanes(row.size, [&](auto f, int k) HWY_ATTR {
        hn::StoreU(
            hn::MulAdd(hn::Set(f, c.weight), hn::LoadU(f, shared + k), hn::LoadU(f, gradient + k)),
            f,
            gradient + k);
      });
      continue;
    }
    // A channel clamped at black, or a weight too small for more than the mean colour.
    for (int k = 0; counts && k < row.position; ++k) gradient[k] += c.weight * shared[k];
    const int sh_end = counts ? row.size : row.sh + 3;
    for (int k = row.sh; k < sh_end; ++k) {
      if (c.color_mask >> ((k - row.sh) % 3) & 1) gradient[k] += c.weight * shared[k];
    }
  }
  if (color_gradient != nullptr) {
    constexpr float kUnit = static_cast<float>(1 / kShDc);
    for (int a = 0; a < 3; ++a) {
      for (int c = 0; c < 3; ++c) {
        gradient[row.color_gradient + 3 * a + c] += kUnit * sums.by_axis[a][c];
        position[a] -= kUnit * sums.by_color[c] * color_gradient[3 * a + c];
      }
    }
  }
  for (int a = 0; a < 3; ++a) gradient[row.position + a] += position[a];
  gradient[row.density] += density;
  return totals;
}

double TotalVariationOfCells(const uint32_t* offsets,
                             const uint32_t* neighbors,
                             const float* weights,
                             uint32_t num_sites,
                             const float* identity,
                             float scale,
                             uint32_t begin,
                             uint32_t end,
                             float* gradient) {
  const hn::CappedTag<float, kIdentityDim> f;
  constexpr size_t kStep = hn::MaxLanes(f);
  constexpr size_t kParts = kIdentityDim / kStep;
  using Part = hn::Vec<decltype(f)>;
  const Part zero = hn::Zero(f);
  double total = 0;
  for (uint32_t i = begin; i < end; ++i) {
    Part own[kParts], by_own[kParts];
    for (size_t p = 0; p < kParts; ++p) {
      own[p] = hn::LoadU(f, identity + size_t{i} * kIdentityDim + p * kStep);
      by_own[p] = zero;
    }
    Part sum = zero;
    for (uint32_t e = offsets[i]; e < offsets[i + 1]; ++e) {
      const uint32_t j = neighbors[e];
      if (j >= num_sites) continue;
      const Part weight = hn::Set(f, weights[e]);
      for (size_t p = 0; p < kParts; ++p) {
        const Part difference =
            hn::Sub(own[p], hn::LoadU(f, identity + size_t{j} * kIdentityDim + p * kStep));
        // weight * sign, 0 at the kink.
        const Part signed_weight =
            hn::IfThenElseZero(hn::Ne(difference, zero), hn::CopySign(weight, difference));
        by_own[p] = hn::Add(by_own[p], signed_weight);
        sum = hn::MulAdd(signed_weight, difference, sum);
      }
    }
    for (size_t p = 0; p < kParts; ++p) {
      hn::StoreU(hn::Mul(hn::Set(f, scale), by_own[p]),
                 f,
                 gradient + size_t{i} * kIdentityDim + p * kStep);
    }
    total += hn::GetLane(hn::SumOfLanes(f, sum));
  }
  return total;
}

void AddColorVariation(const ColorGraph& graph, uint32_t cell, float* gradient) {
  // A lane is a channel; the fourth one is of the number after them in the row, and goes unused.
  const hn::CappedTag<float, 4> f;
  constexpr size_t kStep = hn::MaxLanes(f);
  constexpr size_t kParts = 4 / kStep;
  using Part = hn::Vec<decltype(f)>;
  const Part one = hn::Set(f, 1.f), minus_one = hn::Set(f, -1.f);
  const Part per_knee = hn::Set(f, static_cast<float>(1 / kColorKnee));
  const float* const own = graph.rows + size_t{cell} * kSurfaceColorDim;
  if (own[kOpacityAt] == 0) return;
  Part by_color[kParts], by_axis[3][kParts];
  for (size_t p = 0; p < kParts; ++p) {
    by_color[p] = by_axis[0][p] = by_axis[1][p] = by_axis[2][p] = hn::Zero(f);
  }
  for (uint32_t e = graph.offsets[cell]; e < graph.offsets[cell + 1]; ++e) {
    const uint32_t j = graph.neighbors[e];
    if (j >= graph.num_sites) continue;
    const float* const other = graph.rows + size_t{j} * kSurfaceColorDim;
    if (other[kOpacityAt] == 0) continue;
    const Part weight = hn::Set(f, graph.weights[e] * own[kOpacityAt] * other[kOpacityAt]);
    Part half[3];
    for (int a = 0; a < 3; ++a) {
      half[a] = hn::Set(f, 0.5f * (other[kSiteAt + a] - own[kSiteAt + a]));
    }
    for (size_t p = 0; p < kParts; ++p) {
      const size_t at = p * kStep;
      const auto channels = [&](const float* row, int begin)
                                HWY_ATTR { return hn::LoadU(f, row + begin + at); };
      Part difference = hn::Sub(channels(own, kColorAt), channels(other, kColorAt));
      for (int a = 0; a < 3; ++a) {
        difference =
            hn::MulAdd(half[a], hn::Add(channels(own, 3 * a), channels(other, 3 * a)), difference);
      }
      const Part slope = hn::Mul(weight, hn::Clamp(hn::Mul(difference, per_knee), minus_one, one));
      by_color[p] = hn::Add(by_color[p], slope);
      for (int a = 0; a < 3; ++a) by_axis[a][p] = hn::MulAdd(half[a], slope, by_axis[a][p]);
    }
  }
  alignas(16) float color[4], axis[3][4];
  for (size_t p = 0; p < kParts; ++p) {
    hn::Store(by_color[p], f, color + p * kStep);
    for (int a = 0; a < 3; ++a) hn::Store(by_axis[a][p], f, axis[a] + p * kStep);
  }
  for (int c = 0; c < 3; ++c) {
    for (int a = 0; a < 3; ++a) gradient[3 * a + c] += graph.scale * axis[a][c];
    gradient[kColorGradientDim + c] += graph.scale * static_cast<float>(kShDc) * color[c];
  }
}

void PlanesFromSites(const Eigen::Vector3f* positions,
                     const uint32_t* first_block,
                     int64_t begin,
                     int64_t end,
                     PlaneBlock<float>* blocks,
                     float* nearest_squared) {
  const hn::CappedTag<float, kPlaneLanes> f;
  const hn::Repartition<int32_t, decltype(f)> index;
  constexpr size_t kStep = hn::MaxLanes(f);
  const float* const coordinates = positions->data();
  // As far ahead as memory takes time.
  constexpr uint32_t kPrefetchAhead = 8;
  for (int64_t i = begin; i < end; ++i) {
    const auto x = hn::Set(f, positions[i][0]);
    const auto y = hn::Set(f, positions[i][1]);
    const auto z = hn::Set(f, positions[i][2]);
    const auto self = hn::Set(index, static_cast<int32_t>(i));
    auto nearest = hn::Set(f, std::numeric_limits<float>::infinity());
    for (uint32_t b = first_block[i]; b < first_block[i + 1]; ++b) {
      if (b + kPrefetchAhead < first_block[end]) {
        Prefetch<true>(&blocks[b + kPrefetchAhead], sizeof(PlaneBlock<float>));
      }
      PlaneBlock<float>& block = blocks[b];
      for (size_t lane = 0; lane < kPlaneLanes; lane += kStep) {
        // kNoCell is -1 as a signed number; an empty lane sees the cell itself.
        const auto neighbor =
            hn::Load(index, reinterpret_cast<const int32_t*>(block.neighbor + lane));
        const auto is_empty = hn::Lt(neighbor, hn::Zero(index));
        const auto j = hn::IfThenElse(is_empty, self, neighbor);
        const auto at = hn::Add(j, hn::Add(j, j));
        const auto nx = hn::Sub(hn::GatherIndex(f, coordinates, at), x);
        const auto ny = hn::Sub(hn::GatherIndex(f, coordinates + 1, at), y);
        const auto nz = hn::Sub(hn::GatherIndex(f, coordinates + 2, at), z);
        const auto squared =
            hn::IfThenElse(hn::RebindMask(f, is_empty),
                           hn::Set(f, 2.f),
                           hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz)));
        hn::Store(nx, f, block.normal_x + lane);
        hn::Store(ny, f, block.normal_y + lane);
        hn::Store(nz, f, block.normal_z + lane);
        hn::Store(hn::Mul(hn::Set(f, 0.5f), squared), f, block.half_squared + lane);
        nearest = hn::Min(nearest, squared);
      }
    }
    nearest_squared[i - begin] = hn::GetLane(hn::MinOfLanes(f, nearest));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace semfoam
HWY_AFTER_NAMESPACE();

#endif
