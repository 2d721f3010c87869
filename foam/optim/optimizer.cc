// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/optimizer.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/render/update_loops.h"
#include "foam/util/array_rows.h"
#include "foam/util/parallel.h"
#include "foam/util/prefetch.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

AdamCorrection CorrectionAt(uint32_t step) {
  const std::vector<AdamCorrection>& corrections = AdamCorrections();
  return corrections[std::min<size_t>(step, corrections.size() - 1)];
}

// So many cells before its turn, a cell is loaded into the cache: about as long as memory takes.
constexpr size_t kPrefetchAhead = 4;

// One number for each parameter of a cell.
using CellRow = std::array<float, ParameterRow::kMaxSize>;

// Returns the learning rate of each parameter.
CellRow RowOfRates(const ParameterRow& row, int sh_stride, const LearningRates& rates) {
  CellRow rate = {};
  std::fill_n(rate.begin(), row.position, rates.identity);
  std::fill_n(rate.begin() + row.position, 3, rates.position);
  rate[row.density] = rates.density;
  std::fill(rate.begin() + row.color_gradient, rate.begin() + row.sh, rates.color_gradient);
  std::fill_n(rate.begin() + row.sh, 3, rates.sh_dc);
  std::fill_n(rate.begin() + row.sh + 3, sh_stride - 3, rates.sh_rest);
  return rate;
}

// Adds a row of changes to the parameters that are `stepped`, of all but the cell's identity, in
// units of its step lengths.
// Keeps the site within kFarRadius, and sky where it is. Unless `is_clear`, updates `density` from
// the new raw density.
void AddChange(const ParameterRow& row,
               const ParameterSpan& stepped,
               const float* change,
               int64_t site,
               bool is_clear,
               const StepLengths& lengths,
               Foam* foam,
               float* density) {
  Eigen::Vector3f& position = foam->positions[site];
  if (!IsSkySite(position)) {
    position += lengths.position * Eigen::Vector3f(change + row.position);
    const float distance = position.norm();
    if (distance > kFarRadius) position *= kFarRadius / distance;
  }
  if (!is_clear) {
    float& raw = foam->raw_density[site];
    raw = std::max(raw + change[row.density], kLowestRawDensity);
    *density = Density(raw);
  }
  if (row.HasColorGradient()) {
    StepColorGradient(change + row.color_gradient,
                      lengths.color_gradient,
                      &foam->color_gradient[site * kColorGradientDim]);
  }
  const int sh_stride = foam->ShStride();
  AddTo(change + row.sh, std::min(stepped.end - row.sh, sh_stride), &foam->sh[site * sh_stride]);
}

}  // namespace

StepLengths StepLengthsOf(float radius, bool is_open) {
  constexpr float kSmallest = 5e-4f, kLargestMove = 0.1f, kLargestTextured = 0.02f;
  const float length = std::max(radius, kSmallest);
  const float excess = is_open ? std::numeric_limits<float>::infinity() : length / kLargestTextured;
  return {std::min(length, kLargestMove), length * std::max(1.f, excess)};
}

void CollectSurfaceColors(const Foam& foam,
                          const std::vector<float>& density,
                          const std::vector<StepLengths>& step_lengths,
                          std::vector<float>* rows) {
  CHECK_GE(density.size(), foam.NumSites());
  CHECK_EQ(step_lengths.size(), foam.NumSites());
  rows->resize(foam.NumSites() * kSurfaceColorDim);
  ParallelForBlocks(foam.NumSites(), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      WriteSurfaceColor(
          foam.positions[i],
          CellOpacity(density[i], step_lengths[i].position),
          &foam.sh[i * foam.ShStride()],
          foam.HasColorGradients() ? &foam.color_gradient[i * kColorGradientDim] : nullptr,
          &(*rows)[i * kSurfaceColorDim]);
    }
  });
}

const std::vector<AdamCorrection>& AdamCorrections() {
  static const std::vector<AdamCorrection> corrections = [] {
    std::vector<AdamCorrection> table(2048);
    for (size_t t = 0; t < table.size(); ++t) {
      table[t] = {static_cast<float>(1 / (1 - std::pow(double(kAdamBeta1), t + 1.0))),
                  static_cast<float>(1 / (1 - std::pow(double(kAdamBeta2), t + 1.0)))};
    }
    return table;
  }();
  return corrections;
}

FoamOptimizer::FoamOptimizer(const Foam& foam, const std::vector<uint8_t>& is_frozen)
    : sh_degree_(foam.sh_degree),
      row_(foam.sh_degree, foam.HasSemantics(), foam.HasColorGradients()),
      stride_(row_.size),
      classifier_first_(foam.num_classes * (kIdentityDim + 1), 0.f),
      classifier_second_(classifier_first_) {
  CHECK(is_frozen.empty() || is_frozen.size() == foam.NumSites());
  uint32_t count = 0;
  for (const uint8_t frozen : is_frozen) moments_of_.push_back(frozen ? kNoMoments : count++);
  const size_t num_moments = is_frozen.empty() ? foam.NumSites() : count;
  first_.assign(num_moments * stride_, 0.f);
  second_.assign(num_moments * stride_, 0.f);
  steps_.assign(num_moments, 0);
}

int64_t FoamOptimizer::Step(BatchResult* batch,
                            const std::vector<float>& tv_gradient,
                            const ColorGraph& color_graph,
                            const std::vector<Eigen::Vector3f>& sites,
                            const std::vector<uint8_t>& is_clear,
                            const std::vector<StepLengths>& step_lengths,
                            const LearningRates& rates,
                            Foam* foam,
                            std::vector<float>* density,
                            DensificationStatistics* statistics) {
  const uint32_t num_sites = static_cast<uint32_t>(foam->NumSites());
  CHECK_EQ(moments_of_.empty() ? steps_.size() : moments_of_.size(), num_sites);
  CHECK_GE(sites.size(), num_sites);
  CHECK_EQ(is_clear.size(), num_sites);
  CHECK_EQ(step_lengths.size(), num_sites);
  const bool has_tv = !tv_gradient.empty();
  CHECK_EQ(foam->sh_degree, sh_degree_);
  batch->gradients.Distribute(num_sites);

  alignas(64) const CellRow rate = RowOfRates(row_, foam->ShStride(), rates);
  std::atomic<int64_t> not_finite = 0;
  ParallelForBlocks(batch->gradients.NumBuckets(), 1, [&](int64_t number, int64_t) {
    thread_local GradientSum::Bucket bucket;
    batch->gradients.Group(static_cast<uint32_t>(number), &bucket);
    alignas(64) CellRow gradient, change;
    for (size_t i = bucket.first_cell(); i < bucket.last_cell(); ++i) {
      if (const size_t next = i + kPrefetchAhead;
          next < bucket.last_cell() && !bucket.Of(next).empty()) {
        PrefetchCell(next, *foam);
      }
      const uint32_t m = MomentsOf(i);
      if (m == kNoMoments) continue;
      const auto records = bucket.Of(i);
      if (records.empty() && !has_tv) continue;
      std::fill_n(gradient.begin(), records.empty() ? row_.position : stride_, 0.f);
      const RecordTotals totals = SumRecords(
          records,
          batch->rays.data(),
          row_,
          sites[i],
          row_.HasColorGradient() ? &foam->color_gradient[i * kColorGradientDim] : nullptr,
          gradient.data());
      gradient[row_.density] *= DensityDerivative(foam->raw_density[i]);
      if (color_graph.offsets != nullptr && !records.empty()) {
        float slopes[kColorVariationDim] = {};
        AddColorVariation(color_graph, static_cast<uint32_t>(i), slopes);
        if (row_.HasColorGradient()) {
          AddTo(slopes, kColorGradientDim, &gradient[row_.color_gradient]);
        }
        AddTo(slopes + kColorGradientDim, 3, &gradient[row_.sh]);
      }
      if (has_tv) {
        for (int a = 0; a < kIdentityDim; ++a) gradient[a] += tv_gradient[i * kIdentityDim + a];
      }
      const ParameterSpan stepped =
          ParametersToStep(row_, !records.empty(), totals.largest_weight, has_tv);
      if (!AdamStep(CorrectionAt(steps_[m]),
                    stepped.end - stepped.begin,
                    &gradient[stepped.begin],
                    &rate[stepped.begin],
                    &first_[size_t{m} * stride_ + stepped.begin],
                    &second_[size_t{m} * stride_ + stepped.begin],
                    &change[stepped.begin])) {
        ++not_finite;
        continue;
      }
      ++steps_[m];
      if (!records.empty()) {
        statistics->squared_error[i] += totals.squared_error;
        statistics->contribution[i] = std::max(statistics->contribution[i], totals.largest_weight);
        AddChange(
            row_, stepped, change.data(), i, is_clear[i], step_lengths[i], foam, &(*density)[i]);
      }
      if (stepped.begin == 0 && foam->HasSemantics()) {
        AddTo(change.data(), kIdentityDim, &foam->identity[i * kIdentityDim]);
      }
    }
  });

  return not_finite + StepClassifier(batch->classifier_weight_gradient,
                                     batch->classifier_bias_gradient,
                                     rates.classifier,
                                     foam);
}

void FoamOptimizer::PrefetchCell(size_t site, const Foam& foam) const {
  const uint32_t m = MomentsOf(site);
  if (m == kNoMoments) return;
  Prefetch<true>(&first_[size_t{m} * stride_], stride_ * sizeof(float));
  Prefetch<true>(&second_[size_t{m} * stride_], stride_ * sizeof(float));
  Prefetch<true>(&foam.sh[site * foam.ShStride()], foam.ShStride() * sizeof(float));
  if (foam.HasColorGradients()) {
    Prefetch<true>(&foam.color_gradient[site * kColorGradientDim],
                   kColorGradientDim * sizeof(float));
  }
  if (foam.HasSemantics()) {
    Prefetch<true>(&foam.identity[site * kIdentityDim], kIdentityDim * sizeof(float));
  }
}

int64_t FoamOptimizer::StepClassifier(const std::vector<float>& weight_gradient,
                                      const std::vector<float>& bias_gradient,
                                      float rate,
                                      Foam* foam) {
  const AdamCorrection correction = CorrectionAt(classifier_steps_++);
  int64_t not_finite = 0;
  size_t slot = 0;
  for (const auto& [gradient, parameters] : {std::pair(&weight_gradient, &foam->classifier_weight),
                                             std::pair(&bias_gradient, &foam->classifier_bias)}) {
    const size_t count = parameters->size();
    CHECK_EQ(gradient->size(), count);
    const std::vector<float> rate_of_each(count, rate);
    std::vector<float> change_of_each(count);
    if (AdamStep(correction,
                 static_cast<int>(count),
                 gradient->data(),
                 rate_of_each.data(),
                 classifier_first_.data() + slot,
                 classifier_second_.data() + slot,
                 change_of_each.data())) {
      AddTo(change_of_each.data(), static_cast<int>(count), parameters->data());
    } else {
      ++not_finite;
    }
    slot += count;
  }
  return not_finite;
}

void FoamOptimizer::Rearrange(const std::vector<uint32_t>& origin,
                              const std::vector<uint8_t>& is_new) {
  // Of the moments and counts that there will be: where they come from, and of which sites they
  // are.
  std::vector<uint32_t> old, sites, moments_of;
  for (uint32_t k = 0; k < origin.size(); ++k) {
    const uint32_t m = MomentsOf(origin[k]);
    if (!moments_of_.empty()) {
      moments_of.push_back(m == kNoMoments ? kNoMoments : static_cast<uint32_t>(old.size()));
    }
    if (m == kNoMoments) continue;
    old.push_back(m);
    sites.push_back(k);
  }
  moments_of_ = std::move(moments_of);
  Gather(old, stride_, &first_);
  Gather(old, stride_, &second_);
  Gather(old, 1, &steps_);
  for (size_t m = 0; m < sites.size(); ++m) {
    if (!is_new[sites[m]]) continue;
    std::fill_n(&first_[m * stride_], stride_, 0.f);
    std::fill_n(&second_[m * stride_], stride_, 0.f);
    steps_[m] = 0;
  }
}

void FoamOptimizer::ChangeShDegree(int degree) {
  const ParameterRow row(degree, row_.HasSemantics(), row_.HasColorGradient());
  const int kept = row_.sh + 3 * NumShCoefficients(std::min(sh_degree_, degree));
  first_ = ResizeRows(first_, stride_, kept, row.size);
  second_ = ResizeRows(second_, stride_, kept, row.size);
  sh_degree_ = degree;
  row_ = row;
  stride_ = row.size;
}

}  // namespace semfoam
