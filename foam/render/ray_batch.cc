// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/ray_batch.h"

#include "foam/render/block_exchange.h"
#include "foam/render/block_sums.h"
#include "foam/util/ids.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <span>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Rays of a block are cast by one thread and their sums kept together. At most kMaxBlocks blocks to
// a batch, so that a classifier of thousands of classes does not need thousands of partial sums.
constexpr int64_t kMaxBlocks = 64;
int64_t BlockSize(size_t num_rays) {
  return std::max<int64_t>(64, (num_rays + kMaxBlocks - 1) / kMaxBlocks);
}

// Returns the bytes of a block's sums of the classifier's gradients.
int64_t ClassSumBytes(int num_classes) {
  return int64_t{num_classes} * (kIdentityDim + 1) * int64_t{sizeof(float)};
}

// Blocks whose sums are in memory at a time: all, unless the classes are so many that their sums
// would take more than this; but one for each thread.
int64_t BlocksAtOnce(int num_classes) {
  constexpr int64_t kMostSumBytes = 16'000'000;
  const int64_t fit = kMostSumBytes / std::max<int64_t>(1, ClassSumBytes(num_classes));
  return std::min(kMaxBlocks, std::max<int64_t>(NumThreads(), fit));
}

// When ray i of a block of n is traced. Neighbouring rays cross the same cells; they come one after
// the other, when the cells are in the cache, and not together, when all of them would wait for the
// same cell. So the rays that are in flight together are far apart in the block.
size_t Turn(size_t i, size_t n) {
  const size_t whole_groups = n / kRaysInFlight * kRaysInFlight;
  if (i >= whole_groups) return i;
  const size_t num_groups = n / kRaysInFlight;
  return i % num_groups * kRaysInFlight + i / num_groups;
}

// What the rays of a batch have in common.
struct Batch {
  const WalkGeometry<float>& geometry;
  const CellShading<float>& shading;
  const ClassifierView<float>& classifier;
  const RayLossWeights& weights;
  const float cutoff_tau;
  const std::vector<BatchRay>& rays;

  ParameterRow Row() const {
    return {shading.sh_degree, shading.identity != nullptr, shading.color_gradient != nullptr};
  }
};

// Sets a trace's input.
void SetInput(const BatchRay& ray, RayTrace* trace) {
  trace->origin = ray.origin;
  trace->direction = ray.direction;
  trace->start_cell = ray.start_cell;
  std::copy_n(ray.quantile_tau, kNumQuantiles, trace->quantile_tau);
}

// Adds the terms of a ray's loss and the classifier's gradient to `sums`, the latter times
// `per_ray`. Returns the derivatives by the quantities accumulated along the ray, times `per_ray`.
RayGradient<float> DifferentiateLoss(const Batch& batch,
                                     const RayComposite<float>& composite,
                                     const RayTarget& target,
                                     float per_ray,
                                     ClassLoss* class_loss,
                                     BlockSums* sums) {
  // The classes are many, so they have vector code of their own.
  RayLossTerms<float> loss = RayLoss(composite, target, {}, (float*)nullptr);
  RayGradient<float> gradient =
      RayLossGradient(composite, target, {}, batch.weights, (float*)nullptr);
  if (batch.classifier.num_classes > 0 && target.class_index != Value(kUnlabelled)) {
    loss.identity = class_loss->Add(composite.identity,
                                    target.class_index,
                                    static_cast<float>(batch.weights.identity),
                                    per_ray,
                                    gradient.identity,
                                    sums->weight_gradient.data(),
                                    sums->bias_gradient.data());
  }
  sums->loss += loss;
  ScaleGradient(per_ray, &gradient);
  return gradient;
}

// Casts the rays [begin, end) forward and backward. `outputs` has the rays of the whole batch.
void CastBlock(const Batch& batch,
               int64_t begin,
               int64_t end,
               std::vector<GradientRecord>* records,
               LargePageVector<RayOutput>* outputs,
               BlockSums* sums) {
  const int num_coefficients = NumShCoefficients(batch.shading.sh_degree);
  const ParameterRow row = batch.Row();
  const float per_ray = 1.f / batch.rays.size();
  const float* const identity =
      batch.weights.identity_to_density > 0 ? batch.shading.identity : nullptr;
  records->clear();
  sums->Clear(batch.classifier.num_classes);
  ClassLoss class_loss(batch.classifier);

  const std::span<RayTrace> traces = ThreadTraces(end - begin);
  for (int64_t i = begin; i < end; ++i) {
    SetInput(batch.rays[i], &traces[Turn(i - begin, end - begin)]);
  }
  TraceRays(batch.geometry, batch.shading, batch.cutoff_tau, traces);
  for (int64_t i = begin; i < end; ++i) {
    const RayTrace& trace = traces[Turn(i - begin, end - begin)];
    sums->AddCounts(trace);
    RayGradient<float> gradient;
    if (!IsAstray(trace.num_segments, std::ssize(trace.clamped))) {
      gradient = DifferentiateLoss(
          batch, trace.composite, batch.rays[i].target, per_ray, &class_loss, sums);
    }
    (*outputs)[i].Set(row, gradient, trace.sh_basis, num_coefficients);
    (*outputs)[i].origin = trace.origin;
    (*outputs)[i].direction = trace.direction;
    for (float& g : gradient.identity) g *= static_cast<float>(batch.weights.identity_to_density);
    BackpropagateRay(
        trace, gradient, batch.geometry.num_sites, static_cast<uint32_t>(i), records, identity);
  }
}

// Adds a block's sums to the means over a batch of `num_rays`.
void AddBlock(const BlockSums& sums, size_t num_rays, BatchResult* result) {
  BatchTotals& totals = result->totals;
  totals.mean_loss += sums.loss / static_cast<double>(num_rays);
  for (size_t k = 0; k < sums.weight_gradient.size(); ++k) {
    result->classifier_weight_gradient[k] += sums.weight_gradient[k];
  }
  for (size_t k = 0; k < sums.bias_gradient.size(); ++k) {
    result->classifier_bias_gradient[k] += sums.bias_gradient[k];
  }
  totals.step_limit_hits += sums.step_limit_hits;
  totals.num_segments += sums.num_segments;
  totals.clamped_segments += sums.clamped_segments;
}

}  // namespace

int64_t ClassGradientBytes(int num_classes) {
  // The blocks' sums, the batch's, and a ClassLoss for each thread.
  return ClassSumBytes(num_classes) * (BlocksAtOnce(num_classes) + 1 + NumThreads());
}

void CastBatch(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               const ClassifierView<float>& classifier,
               const RayLossWeights& weights,
               float cutoff_tau,
               const std::vector<BatchRay>& rays,
               BatchResult* result,
               RankGroup* ranks) {
  const Batch batch{geometry, shading, classifier, weights, cutoff_tau, rays};
  const int64_t block_size = BlockSize(rays.size());
  const int64_t num_blocks = (std::ssize(rays) + block_size - 1) / block_size;
  const int num_classes = classifier.num_classes;
  const int64_t blocks_at_once =
      ranks == nullptr ? std::min(num_blocks, BlocksAtOnce(num_classes)) : num_blocks;
  CHECK(ranks == nullptr || geometry.num_sites < kMostCellsToExchange);
  std::vector<BlockSums> sums(blocks_at_once);
  auto& blocks = result->gradients.blocks();
  blocks.resize(num_blocks);
  result->rays.resize(rays.size());
  result->totals = {};
  result->classifier_weight_gradient.assign(num_classes * kIdentityDim, 0.f);
  result->classifier_bias_gradient.assign(num_classes, 0.f);

  for (int64_t first = 0; first < num_blocks; first += blocks_at_once) {
    const int64_t count = std::min(blocks_at_once, num_blocks - first);
    const BlockRange own = ranks == nullptr
                               ? BlockRange{0, count}
                               : BlocksOfRank(count, ranks->rank(), ranks->num_ranks());
    ParallelForBlocks(own.last - own.first, 1, [&](int64_t k, int64_t) {
      const int64_t block = first + own.first + k;
      CastBlock(batch,
                block * block_size,
                std::min(std::ssize(rays), (block + 1) * block_size),
                &blocks[block],
                &result->rays,
                &sums[block - first]);
    });
    if (ranks != nullptr) {
      ExchangeBlocks(rays, block_size, num_classes, batch.Row(), ranks, &sums, result);
    }
    // In block order, so that the sums are the same however many blocks are cast at a time.
    for (int64_t k = 0; k < count; ++k) AddBlock(sums[k], rays.size(), result);
  }
}

}  // namespace semfoam
