// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/segment_pool.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_loss.h"
#include "foam/util/host_device.h"
#include "foam/util/ids.h"

#include <algorithm>
#include <cstdint>

// CastBatch (ray_batch.h) as kernels. Each kernel documents what one thread does. All arrays are
// the GPU's.

namespace semfoam {

// A training sample of the classifier: an identity and its class.
struct ClassSample {
  float identity[kIdentityDim];
  // kUnlabelled: none.
  int32_t class_index;
  // Logarithm of the sum of the exponentials of the logits.
  float log_sum;
  // Factor of the derivatives by the logits.
  float scale;
};

// Losses and counts of one ray, to be summed.
struct RayTally {
  RayLossTerms<float> loss;
  // End of the ray's contributions.
  SlotCursor end;
  uint32_t num_contributions = 0;
  uint32_t num_segments = 0;
  uint32_t num_clamped = 0;
  uint32_t hit_step_limit = 0;
};

// Casts a ray forward and backward. Thread: ray.
struct CastRay {
  WalkView<float> geometry;
  CellShading<float> shading;
  ClassifierView<float> classifier;
  RayLossWeights weights;
  float cutoff_tau;
  ParameterRow row;
  uint32_t num_rays;
  const BatchRay* rays;

  SegmentPool pool;
  RayOutput* outputs;    // [num_rays]
  ClassSample* samples;  // [num_rays]; null without semantics
  RayTally* tallies;     // [num_rays]

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    const BatchRay& ray = rays[i];
    const RayTarget& target = ray.target;
    const float per_ray = 1.f / num_rays;
    PooledRecord record(pool);
    record.origin = ray.origin;
    record.direction = ray.direction;
    record.composite = {};
    for (int q = 0; q < kNumQuantiles; ++q) record.composite.quantile_tau[q] = ray.quantile_tau[q];
    TraceRay(geometry, shading, ray.start_cell, cutoff_tau, &record);
    // Reserves a slot for the cell behind the last segment.
    const bool has_room = record.AddRoom();
    RayTally& tally = tallies[i] = {};
    if (record.overflow || !has_room) return;  // all will be cast anew, with a larger pool

    const bool teaches = !IsAstray(record.num_segments, record.num_clamped);
    RayLossTerms<float> loss;
    RayGradient<float> gradient;
    if (teaches) {
      loss = RayLoss(record.composite, target, {}, static_cast<float*>(nullptr));
      gradient =
          RayLossGradient(record.composite, target, {}, weights, static_cast<float*>(nullptr));
    }
    const bool is_labelled =
        teaches && classifier.num_classes > 0 && target.class_index != Value(kUnlabelled);
    if (samples != nullptr) {
      loss.identity = Classify(record.composite.identity,
                               is_labelled ? target.class_index : Value(kUnlabelled),
                               static_cast<float>(weights.identity),
                               per_ray,
                               gradient.identity,
                               &samples[i]);
    }
    ScaleGradient(per_ray, &gradient);
    outputs[i].Set(row, gradient, record.sh_basis, NumShCoefficients(shading.sh_degree));
    outputs[i].origin = ray.origin;
    outputs[i].direction = ray.direction;
    for (float& g : gradient.identity) g *= static_cast<float>(weights.identity_to_density);

    ContributionWriter writer(pool, record.end());
    BackpropagateRay(
        geometry,
        record,
        gradient,
        [&](const CellContribution<float>& c) { writer.Write(static_cast<uint32_t>(i), c); },
        weights.identity_to_density > 0 ? shading.identity : nullptr);
    tally.loss = loss;
    tally.end = record.end();
    tally.num_contributions = writer.num_written();
    tally.num_segments = record.num_segments;
    tally.num_clamped = record.num_clamped;
    tally.hit_step_limit = record.hit_step_limit;
  }

 private:
  // Computes the cross-entropy of an identity, and writes the classifier's training sample. See
  // ClassLoss::Add.
  SEMFOAM_HOST_DEVICE float Classify(const float* identity,
                                     int32_t class_index,
                                     float weight,
                                     float scale,
                                     float* gradient,
                                     ClassSample* sample) const {
    sample->class_index = class_index;
    if (class_index == Value(kUnlabelled)) return 0;
    for (int c = 0; c < kIdentityDim; ++c) sample->identity[c] = identity[c];
    sample->scale = static_cast<float>(weight * scale / ClassNormalization(classifier.num_classes));
    return AddClassEntropy(identity, class_index, classifier, weight, gradient, &sample->log_sum);
  }
};

// Sums the tallies of kRaysPerTally rays, in their order.
inline constexpr int64_t kRaysPerTally = 256;
struct TallySum {
  RayLossTerms<double> loss;
  int64_t step_limit_hits = 0;
  int64_t num_segments = 0;
  int64_t clamped_segments = 0;
  int64_t num_contributions = 0;
};
// Thread: sum.
struct SumTallies {
  const RayTally* tallies;
  int64_t num_rays;
  TallySum* sums;

  SEMFOAM_HOST_DEVICE void operator()(int64_t k) const {
    TallySum sum;
    const int64_t end = num_rays < (k + 1) * kRaysPerTally ? num_rays : (k + 1) * kRaysPerTally;
    for (int64_t i = k * kRaysPerTally; i < end; ++i) {
      const RayTally& tally = tallies[i];
      sum.loss += tally.loss;
      sum.step_limit_hits += tally.hit_step_limit;
      sum.num_segments += tally.num_segments;
      sum.clamped_segments += tally.num_clamped;
      sum.num_contributions += tally.num_contributions;
    }
    sums[k] = sum;
  }
};

// Thread: ray.
struct CountContributions {
  const RayTally* tallies;
  uint32_t* counts;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const { counts[i] = tallies[i].num_contributions; }
};

// Lists the pool positions of the contributions in the order of the rays. The position of a ray's
// chunks in the pool depends on the scheduling of the threads; the order of this list does not.
// Thread: ray.
struct ListContributions {
  SegmentPool pool;
  const RayTally* tallies;
  const uint32_t* first;  // [num_rays] in the list

  uint32_t* cells;  // [number of contributions]
  uint32_t* slots;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    SlotCursor cursor = tallies[i].end;
    uint32_t at = first[i];
    for (uint32_t k = 0; k < tallies[i].num_contributions; ++k, ++at) {
      slots[at] = cursor.Back(pool);
      cells[at] = pool.slots[slots[at]].cell;
    }
  }
};

// Finds where each cell's contributions begin and end in the sorted list. Thread: contribution.
struct FindRuns {
  const uint32_t* cells;  // sorted
  int64_t count;
  uint32_t* begin;  // [num_sites], zero before
  uint32_t* end;    // likewise

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    if (i == 0 || cells[i - 1] != cells[i]) begin[cells[i]] = static_cast<uint32_t>(i);
    if (i + 1 == count || cells[i + 1] != cells[i]) end[cells[i]] = static_cast<uint32_t>(i + 1);
  }
};

// Sums the derivatives by the classifier's parameters over parts of the samples. A row of kClassRow
// values holds the weights and the bias of a class. Thread: part and class.
inline constexpr int kClassRow = kIdentityDim + 1;
struct SumClassGradients {
  ClassifierView<float> classifier;
  const ClassSample* samples;
  int64_t num_samples;
  int64_t samples_per_part;
  float* sums;  // [parts][num_classes][kClassRow]

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    const int64_t part = t / classifier.num_classes;
    const int k = static_cast<int>(t % classifier.num_classes);
    float sum[kClassRow] = {};
    const int64_t last = (part + 1) * samples_per_part;
    const int64_t end = num_samples < last ? num_samples : last;
    for (int64_t i = part * samples_per_part; i < end; ++i) {
      const ClassSample& sample = samples[i];
      if (sample.class_index == Value(kUnlabelled)) continue;
      const float logit = ClassLogit(classifier.weight, classifier.bias, k, sample.identity);
      const float by_logit =
          sample.scale * (std::exp(logit - sample.log_sum) - float(k == sample.class_index));
      for (int c = 0; c < kIdentityDim; ++c) sum[c] += by_logit * sample.identity[c];
      sum[kIdentityDim] += by_logit;
    }
    for (int c = 0; c < kClassRow; ++c) sums[t * kClassRow + c] = sum[c];
  }
};

// Sums the parts. Thread: parameter.
struct AddClassParts {
  const float* sums;
  int64_t num_parts;
  int64_t num_parameters;  // num_classes * kClassRow
  float* total;            // [num_parameters]

  SEMFOAM_HOST_DEVICE void operator()(int64_t p) const {
    float sum = 0;
    for (int64_t part = 0; part < num_parts; ++part) sum += sums[part * num_parameters + p];
    total[p] = sum;
  }
};

}  // namespace semfoam
