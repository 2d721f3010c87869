// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/ray_batch.h"

#include "foam/parallel.h"

#include <algorithm>

namespace semfoam {
namespace {

// Rays of a block are cast by one thread and their sums kept together. At most 64 blocks to a
// batch, so that a classifier of thousands of classes does not need thousands of partial sums.
int64_t BlockSize(size_t num_rays) { return std::max<int64_t>(64, (num_rays + 63) / 64); }

struct BlockSums {
  RayLossTerms<double> loss;
  std::vector<float> weight_gradient;
  std::vector<float> bias_gradient;
  int64_t step_limit_hits = 0;
  int64_t num_pieces = 0;
};

}  // namespace

void CastBatch(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               const ClassifierView<float>& classifier,
               const RayLossWeights& weights,
               float cutoff_tau,
               const std::vector<BatchRay>& rays,
               BatchResult* result) {
  const int64_t block_size = BlockSize(rays.size());
  const size_t num_blocks = (rays.size() + block_size - 1) / block_size;
  const int num_classes = classifier.num_classes;
  const float per_ray = 1.f / rays.size();
  std::vector<BlockSums> sums(num_blocks);
  auto& blocks = result->gradients.blocks();
  blocks.resize(num_blocks);
  result->rays.resize(rays.size());

  ParallelForBlocks(rays.size(), block_size, [&](int64_t begin, int64_t end) {
    const size_t block = begin / block_size;
    std::vector<GradientRecord>& records = blocks[block];
    records.clear();
    BlockSums& sum = sums[block];
    sum.weight_gradient.assign(num_classes * kIdentityDim, 0.f);
    sum.bias_gradient.assign(num_classes, 0.f);
    std::vector<float> logits(num_classes);
    thread_local RayRecord<float> record;
    for (int64_t i = begin; i < end; ++i) {
      const BatchRay& ray = rays[i];
      record.origin = ray.origin;
      record.direction = ray.direction;
      record.composite = {};
      std::copy_n(ray.quantile_tau, kNumQuantiles, record.composite.quantile_tau);
      TraceRay(geometry, shading, ray.start_cell, cutoff_tau, &record);
      sum.step_limit_hits += record.hit_step_limit;
      sum.num_pieces += record.pieces.size();

      const RayLossTerms<float> loss =
          RayLoss(record.composite, ray.target, classifier, logits.data());
      sum.loss.color += loss.color;
      sum.loss.opacity += loss.opacity;
      sum.loss.quantile += loss.quantile;
      sum.loss.identity += loss.identity;
      RayGradient<float> gradient =
          RayLossGradient(record.composite, ray.target, classifier, weights, logits.data());

      if (num_classes > 0 && ray.target.class_index != kUnlabelled) {
        for (int k = 0; k < num_classes; ++k) {
          for (int c = 0; c < kIdentityDim; ++c) {
            sum.weight_gradient[k * kIdentityDim + c] +=
                logits[k] * record.composite.identity[c] * per_ray;
          }
          sum.bias_gradient[k] += logits[k] * per_ray;
        }
      }
      RayOutput& out = result->rays[i];
      for (int c = 0; c < 3; ++c) {
        gradient.color[c] *= per_ray;
        out.color_gradient[c] = gradient.color[c];
      }
      gradient.opacity *= per_ray;
      for (float& g : gradient.quantile_depth) g *= per_ray;
      for (int c = 0; c < kIdentityDim; ++c) {
        out.identity_gradient[c] = gradient.identity[c] * per_ray;
      }
      std::copy_n(record.sh_basis, kMaxShCoefficients, out.sh_basis);
      BackpropagateRay(geometry, record, gradient, [&](const CellContribution<float>& c) {
        records.push_back({static_cast<uint32_t>(i), c});
      });
    }
  });

  result->mean_loss = {};
  result->classifier_weight_gradient.assign(num_classes * kIdentityDim, 0.f);
  result->classifier_bias_gradient.assign(num_classes, 0.f);
  result->step_limit_hits = 0;
  result->num_pieces = 0;
  for (const BlockSums& sum : sums) {
    result->mean_loss.color += sum.loss.color / rays.size();
    result->mean_loss.opacity += sum.loss.opacity / rays.size();
    result->mean_loss.quantile += sum.loss.quantile / rays.size();
    result->mean_loss.identity += sum.loss.identity / rays.size();
    for (size_t k = 0; k < sum.weight_gradient.size(); ++k) {
      result->classifier_weight_gradient[k] += sum.weight_gradient[k];
    }
    for (size_t k = 0; k < sum.bias_gradient.size(); ++k) {
      result->classifier_bias_gradient[k] += sum.bias_gradient[k];
    }
    result->step_limit_hits += sum.step_limit_hits;
    result->num_pieces += sum.num_pieces;
  }
}

}  // namespace semfoam
