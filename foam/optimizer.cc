// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optimizer.h"

#include "foam/activation.h"
#include "foam/gather.h"
#include "foam/guard_sites.h"
#include "foam/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr float kBeta1 = 0.9f;
constexpr float kBeta2 =
    0.99f;  // short memory: a cell sees hundreds of gradients in a run, not tens of thousands
constexpr float kEpsilon = 1e-15f;
// Below this raw density a cell's gradient has all but vanished and it could never come back
// (Radiant Foam's "transparent" value).
constexpr float kLowestRawDensity = -1;

constexpr int kMaxStride = 4 + 3 * kMaxShCoefficients + kIdentityDim;

// Bias corrections 1 / (1 - beta1^t) and 1 / (1 - beta2^t), by step; from the table's end on they
// are 1.
struct BiasCorrection {
  static constexpr uint32_t kSize = 2048;
  std::array<float, kSize> first, second;

  BiasCorrection() {
    for (uint32_t t = 0; t < kSize; ++t) {
      first[t] = static_cast<float>(1 / (1 - std::pow(double(kBeta1), t + 1.0)));
      second[t] = static_cast<float>(1 / (1 - std::pow(double(kBeta2), t + 1.0)));
    }
  }
};

const BiasCorrection& Corrections() {
  static const BiasCorrection corrections;
  return corrections;
}

// One Adam step of one parameter; returns what to add to it.
float AdamStep(
    float gradient, float rate, float correct1, float correct2, float* first, float* second) {
  *first = kBeta1 * *first + (1 - kBeta1) * gradient;
  *second = kBeta2 * *second + (1 - kBeta2) * gradient * gradient;
  return -rate * (*first * correct1) / (std::sqrt(*second * correct2) + kEpsilon);
}

int Stride(const Foam& foam) {
  return 4 + foam.ShStride() + (foam.HasSemantics() ? kIdentityDim : 0);
}

}  // namespace

FoamOptimizer::FoamOptimizer(const Foam& foam)
    : stride_(Stride(foam)),
      first_(foam.NumSites() * stride_, 0.f),
      second_(foam.NumSites() * stride_, 0.f),
      steps_(foam.NumSites(), 0),
      classifier_first_(foam.num_classes * (kIdentityDim + 1), 0.f),
      classifier_second_(classifier_first_) {}

int64_t FoamOptimizer::Step(BatchResult* batch,
                            const std::vector<float>& tv_gradient,
                            const std::vector<uint8_t>& is_clear,
                            const LearningRates& rates,
                            Foam* foam,
                            DensificationStatistics* statistics) {
  const uint32_t num_sites = static_cast<uint32_t>(foam->NumSites());
  CHECK_EQ(steps_.size(), num_sites);
  CHECK_EQ(is_clear.size(), num_sites);
  const int sh_stride = foam->ShStride();
  const int num_coefficients = NumShCoefficients(foam->sh_degree);
  const int identity_begin = 4 + sh_stride;
  const bool has_tv = !tv_gradient.empty();
  batch->gradients.Group(num_sites);

  std::array<float, kMaxStride> rate;
  std::fill_n(rate.begin(), 3, rates.position);
  rate[3] = rates.density;
  std::fill_n(rate.begin() + 4, 3, rates.sh_dc);
  std::fill_n(rate.begin() + 7, sh_stride - 3, rates.sh_rest);
  std::fill(rate.begin() + identity_begin, rate.begin() + stride_, rates.identity);

  std::atomic<int64_t> not_finite = 0;
  ParallelForBlocks(num_sites, 256, [&](int64_t begin, int64_t end) {
    std::array<float, kMaxStride> gradient;
    for (int64_t i = begin; i < end; ++i) {
      const auto records = batch->gradients.Of(i);
      if (records.empty() && !has_tv) continue;
      std::fill_n(gradient.begin(), stride_, 0.f);
      float* const sh = gradient.data() + 4;
      float* const identity = gradient.data() + identity_begin;
      float largest_weight = 0;
      for (const GradientRecord& record : records) {
        const CellContribution<float>& c = record.contribution;
        for (int a = 0; a < 3; ++a) gradient[a] += c.position[a];
        gradient[3] += c.density;
        if (c.weight == 0) continue;
        largest_weight = std::max(largest_weight, c.weight);
        const RayOutput& ray = batch->rays[record.ray];
        float weighted[3];
        for (int a = 0; a < 3; ++a) {
          weighted[a] = (c.color_mask >> a & 1) ? c.weight * ray.color_gradient[a] : 0.f;
        }
        for (int k = 0; k < num_coefficients; ++k) {
          for (int a = 0; a < 3; ++a) sh[3 * k + a] += ray.sh_basis[k] * weighted[a];
        }
        if (foam->HasSemantics()) {
          for (int a = 0; a < kIdentityDim; ++a) identity[a] += c.weight * ray.identity_gradient[a];
        }
      }
      gradient[3] *= DensityDerivative(foam->raw_density[i]);
      if (has_tv) {
        for (int a = 0; a < kIdentityDim; ++a) identity[a] += tv_gradient[i * kIdentityDim + a];
      }
      float sum = 0;
      for (int k = 0; k < stride_; ++k) sum += gradient[k] * gradient[k];
      if (!std::isfinite(sum)) {
        ++not_finite;
        continue;
      }
      const Eigen::Vector3f by_position(gradient[0], gradient[1], gradient[2]);
      statistics->error[i] += by_position.norm();
      statistics->contribution[i] = std::max(statistics->contribution[i], largest_weight);

      // A step that is the regulariser's alone moves the identity and nothing else.
      const int first_parameter = records.empty() ? identity_begin : 0;
      const uint32_t t = std::min(steps_[i]++, BiasCorrection::kSize - 1);
      const float correct1 = Corrections().first[t], correct2 = Corrections().second[t];
      float* const m = &first_[i * stride_];
      float* const v = &second_[i * stride_];
      std::array<float, kMaxStride> change;
      for (int k = first_parameter; k < stride_; ++k) {
        change[k] = AdamStep(gradient[k], rate[k], correct1, correct2, &m[k], &v[k]);
      }
      if (!records.empty()) {
        Eigen::Vector3f& position = foam->positions[i];
        position += Eigen::Vector3f(change[0], change[1], change[2]);
        const float distance = position.norm();
        if (distance > kFarRadius) position *= kFarRadius / distance;
        float& raw = foam->raw_density[i];
        raw = is_clear[i] ? kLowestRawDensity : std::max(raw + change[3], kLowestRawDensity);
        for (int k = 0; k < sh_stride; ++k) foam->sh[i * sh_stride + k] += change[4 + k];
      }
      if (foam->HasSemantics()) {
        for (int a = 0; a < kIdentityDim; ++a) {
          foam->identity[i * kIdentityDim + a] += change[identity_begin + a];
        }
      }
    }
  });

  const uint32_t t = std::min(classifier_steps_++, BiasCorrection::kSize - 1);
  const float correct1 = Corrections().first[t], correct2 = Corrections().second[t];
  for (int k = 0; k < foam->num_classes; ++k) {
    for (int a = 0; a <= kIdentityDim; ++a) {
      const bool is_bias = a == kIdentityDim;
      const float gradient = is_bias ? batch->classifier_bias_gradient[k]
                                     : batch->classifier_weight_gradient[k * kIdentityDim + a];
      if (!std::isfinite(gradient)) {
        ++not_finite;
        continue;
      }
      const size_t slot = size_t(k) * (kIdentityDim + 1) + a;
      float& parameter =
          is_bias ? foam->classifier_bias[k] : foam->classifier_weight[k * kIdentityDim + a];
      parameter += AdamStep(gradient,
                            rates.classifier,
                            correct1,
                            correct2,
                            &classifier_first_[slot],
                            &classifier_second_[slot]);
    }
  }
  return not_finite;
}

void FoamOptimizer::Rearrange(const std::vector<uint32_t>& origin,
                              const std::vector<uint8_t>& is_new) {
  Gather(origin, stride_, &first_);
  Gather(origin, stride_, &second_);
  Gather(origin, 1, &steps_);
  for (size_t k = 0; k < origin.size(); ++k) {
    if (!is_new[k]) continue;
    std::fill_n(&first_[k * stride_], stride_, 0.f);
    std::fill_n(&second_[k * stride_], stride_, 0.f);
    steps_[k] = 0;
  }
}

}  // namespace semfoam
