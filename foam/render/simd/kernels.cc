// SPDX-License-Identifier: GPL-3.0-or-later
//
// All vector code, compiled once per instruction set; the caller gets the best that the machine
// has.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "foam/render/simd/kernels.cc"
// SSE4, AVX2 and AVX-512 are worth their code; the steps between them are not. SVE's vectors, whose
// length is not known here, cannot stand in arrays; machines that have it have NEON.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>
// foreach_target.h comes first.
#include "foam/render/ray_tracer.h"
#include "foam/render/simd/render-inl.h"
#include "foam/render/simd/update-inl.h"
#include "foam/render/simd/walk-inl.h"
#include "foam/render/update_loops.h"

#include <hwy/highway.h>

#if HWY_ONCE
#include <glog/logging.h>

namespace semfoam {

HWY_EXPORT(WalkRays);

void WalkRays(const WalkGeometry<float>& geometry,
              std::span<const WalkQuery> rays,
              int rays_in_flight,
              std::span<WalkResult> results) {
  CHECK_EQ(rays.size(), results.size());
  HWY_DYNAMIC_DISPATCH(WalkRays)
  (geometry, rays.data(), rays.size(), rays_in_flight, results.data());
}

std::span<RayTrace> ThreadTraces(size_t count) {
  thread_local std::vector<RayTrace> traces;
  if (traces.size() < count) traces.resize(count);
  for (size_t i = 0; i < count; ++i) {
    traces[i].start_cell = 0;
    std::fill_n(traces[i].quantile_tau, kNumQuantiles, std::numeric_limits<float>::infinity());
  }
  return {traces.data(), count};
}

HWY_EXPORT(TraceRays);

void TraceRays(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               float cutoff_tau,
               std::span<RayTrace> rays) {
  HWY_DYNAMIC_DISPATCH(TraceRays)(geometry, shading, cutoff_tau, rays.data(), rays.size());
}

HWY_EXPORT(BackpropagateRay);

void BackpropagateRay(const RayTrace& ray,
                      const RayGradient<float>& gradient,
                      uint32_t num_sites,
                      uint32_t ray_index,
                      std::vector<GradientRecord>* records,
                      const float* identity) {
  HWY_DYNAMIC_DISPATCH(BackpropagateRay)(ray, gradient, num_sites, ray_index, records, identity);
}

HWY_EXPORT(AddClassLoss);

ClassLoss::ClassLoss(const ClassifierView<float>& classifier)
    : classifier_(classifier),
      padded_classes_((classifier.num_classes + kPlaneLanes - 1) / kPlaneLanes * kPlaneLanes),
      transposed_(padded_classes_ * kIdentityDim, 0.f),
      bias_(padded_classes_, -std::numeric_limits<float>::infinity()),
      logits_(padded_classes_) {
  for (int k = 0; k < classifier.num_classes; ++k) {
    bias_[k] = classifier.bias[k];
    for (int c = 0; c < kIdentityDim; ++c) {
      transposed_[c * padded_classes_ + k] = classifier.weight[size_t(k) * kIdentityDim + c];
    }
  }
}

float ClassLoss::Add(const float* identity,
                     int32_t class_index,
                     float weight,
                     float scale,
                     float* identity_gradient,
                     float* weight_gradient,
                     float* bias_gradient) {
  DCHECK_LT(class_index, classifier_.num_classes);
  return HWY_DYNAMIC_DISPATCH(AddClassLoss)(classifier_,
                                            transposed_.data(),
                                            bias_.data(),
                                            padded_classes_,
                                            identity,
                                            class_index,
                                            weight,
                                            scale,
                                            logits_.data(),
                                            identity_gradient,
                                            weight_gradient,
                                            bias_gradient);
}

HWY_EXPORT(AdamStep);

bool AdamStep(const AdamCorrection& correction,
              int count,
              const float* gradient,
              const float* rate,
              float* first_moment,
              float* second_moment,
              float* change) {
  return HWY_DYNAMIC_DISPATCH(AdamStep)(
      correction, count, gradient, rate, first_moment, second_moment, change);
}

HWY_EXPORT(AddTo);

void AddTo(const float* change, int count, float* parameters) {
  HWY_DYNAMIC_DISPATCH(AddTo)(change, count, parameters);
}

HWY_EXPORT(SumRecords);

RecordTotals SumRecords(std::span<const GradientRecord> records,
                        const RayOutput* rays,
                        const ParameterRow& row,
                        const Eigen::Vector3f& site,
                        const float* color_gradient,
                        float* gradient) {
  return HWY_DYNAMIC_DISPATCH(SumRecords)(
      records.data(), records.size(), rays, row, site, color_gradient, gradient);
}

HWY_EXPORT(TotalVariationOfCells);

double TotalVariationOfCells(const uint32_t* offsets,
                             const uint32_t* neighbors,
                             const float* weights,
                             uint32_t num_sites,
                             const float* identity,
                             float scale,
                             uint32_t begin,
                             uint32_t end,
                             float* gradient) {
  return HWY_DYNAMIC_DISPATCH(TotalVariationOfCells)(
      offsets, neighbors, weights, num_sites, identity, scale, begin, end, gradient);
}

HWY_EXPORT(AddColorVariation);

void AddColorVariation(const ColorGraph& graph, uint32_t cell, float* gradient) {
  HWY_DYNAMIC_DISPATCH(AddColorVariation)(graph, cell, gradient);
}

HWY_EXPORT(PlanesFromSites);

void PlanesFromSites(const Eigen::Vector3f* positions,
                     const uint32_t* first_block,
                     int64_t begin,
                     int64_t end,
                     PlaneBlock<float>* blocks,
                     float* nearest_squared) {
  HWY_DYNAMIC_DISPATCH(PlanesFromSites)
  (positions, first_block, begin, end, blocks, nearest_squared);
}

namespace {

const char* FamilyName(int64_t target) {
  return target == HWY_AVX3 ? "AVX-512" : hwy::TargetName(target);
}

}  // namespace

std::vector<std::string> SimdTargets() {
  // Determined once, before UseSimdTarget narrows the choice.
  static const std::vector<int64_t> targets = hwy::SupportedAndGeneratedTargets();
  std::vector<std::string> names;
  names.reserve(targets.size());
  for (const int64_t target : targets) names.emplace_back(FamilyName(target));
  return names;
}

void UseSimdTarget(const std::string& name) {
  SimdTargets();
  hwy::SetSupportedTargetsForTest(0);
  int64_t wanted = 0;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    if (name == FamilyName(target)) wanted = target;
  }
  CHECK(name.empty() || wanted != 0) << name << " is not one of SimdTargets()";
  hwy::SetSupportedTargetsForTest(wanted);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace semfoam
#endif
