// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/ray_batch.h"

#include "foam/util/parallel.h"

#include <algorithm>

namespace semfoam {
namespace {

// Rays of a block are cast by one thread and their sums kept together. At most kMaxBlocks blocks to
// a batch, so that a classifier of thousands of classes does not need thousands of partial sums.
constexpr int64_t kMaxBlocks = 64;
int64_t BlockSize(size_t num_rays) {
  return std::max<int64_t>(64, (num_rays + kMaxBlocks - 1) / kMaxBlocks);
}

// A block's sums of the classifier's gradients.
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

struct BlockSums {
  RayLossTerms<double> loss;
  std::vector<float> weight_gradient;
  std::vector<float> bias_gradient;
  int64_t step_limit_hits = 0;
  int64_t num_segments = 0;
  int64_t clamped_segments = 0;
};

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
               BatchResult* result) {
  const int64_t block_size = BlockSize(rays.size());
  const size_t num_blocks = (rays.size() + block_size - 1) / block_size;
  const int num_classes = classifier.num_classes;
  const int num_coefficients = NumShCoefficients(shading.sh_degree);
  const ParameterRow row(shading.sh_degree, shading.identity != nullptr);
  const float per_ray = 1.f / rays.size();
  const int64_t blocks_at_once = BlocksAtOnce(num_classes);
  std::vector<BlockSums> sums(std::min<size_t>(num_blocks, blocks_at_once));
  auto& blocks = result->gradients.blocks();
  blocks.resize(num_blocks);
  result->rays.resize(rays.size());

  // Casts the rays of one block.
  const auto cast = [&](int64_t begin, int64_t end) {
    const size_t block = begin / block_size;
    std::vector<GradientRecord>& records = blocks[block];
    records.clear();
    BlockSums& sum = sums[block % sums.size()];
    sum.loss = {};
    sum.step_limit_hits = sum.num_segments = sum.clamped_segments = 0;
    sum.weight_gradient.assign(num_classes * kIdentityDim, 0.f);
    sum.bias_gradient.assign(num_classes, 0.f);
    ClassLoss class_loss(classifier);
    const std::span<RayTrace> traces = ThreadTraces(end - begin);
    for (int64_t i = begin; i < end; ++i) {
      RayTrace& trace = traces[Turn(i - begin, end - begin)];
      trace.origin = rays[i].origin;
      trace.direction = rays[i].direction;
      trace.start_cell = rays[i].start_cell;
      std::copy_n(rays[i].quantile_tau, kNumQuantiles, trace.quantile_tau);
    }
    TraceRays(geometry, shading, cutoff_tau, traces);
    for (int64_t i = begin; i < end; ++i) {
      const RayTrace& trace = traces[Turn(i - begin, end - begin)];
      const RayTarget& target = rays[i].target;
      sum.step_limit_hits += trace.hit_step_limit;
      sum.num_segments += trace.num_segments;
      sum.clamped_segments += trace.clamped.size();

      // The classes are many, so they have vector code of their own.
      const RayLossTerms<float> loss = RayLoss(trace.composite, target, {}, (float*)nullptr);
      sum.loss.color += loss.color;
      sum.loss.opacity += loss.opacity;
      sum.loss.quantile += loss.quantile;
      RayGradient<float> gradient =
          RayLossGradient(trace.composite, target, {}, weights, (float*)nullptr);
      if (num_classes > 0 && target.class_index != kUnlabelled) {
        sum.loss.identity += class_loss.Add(trace.composite.identity,
                                            target.class_index,
                                            static_cast<float>(weights.identity),
                                            per_ray,
                                            gradient.identity,
                                            sum.weight_gradient.data(),
                                            sum.bias_gradient.data());
      }
      for (float& g : gradient.color) g *= per_ray;
      gradient.opacity *= per_ray;
      for (float& g : gradient.quantile_depth) g *= per_ray;
      for (float& g : gradient.identity) g *= per_ray;
      float* const out = result->rays[i].parameters;
      std::copy_n(gradient.identity, row.position, out);
      for (float& g : gradient.identity) g *= static_cast<float>(weights.identity_to_density);
      std::fill(out + row.position, out + row.sh, 0.f);
      for (int k = 0; k < num_coefficients; ++k) {
        for (int c = 0; c < 3; ++c) {
          out[row.sh + 3 * k + c] = gradient.color[c] * trace.sh_basis[k];
        }
      }
      std::fill(out + row.sh + 3 * num_coefficients, out + row.size, 0.f);
      BackpropagateRay(trace,
                       gradient,
                       geometry.num_sites,
                       static_cast<uint32_t>(i),
                       &records,
                       weights.identity_to_density > 0 ? shading.identity : nullptr);
    }
  };

  BatchTotals& totals = result->totals;
  totals = {};
  result->classifier_weight_gradient.assign(num_classes * kIdentityDim, 0.f);
  result->classifier_bias_gradient.assign(num_classes, 0.f);
  const auto num_rays = static_cast<int64_t>(rays.size());
  const int64_t rays_at_once = block_size * blocks_at_once;
  for (int64_t first = 0; first < num_rays; first += rays_at_once) {
    const int64_t count = std::min(rays_at_once, num_rays - first);
    ParallelForBlocks(
        count, block_size, [&](int64_t begin, int64_t end) { cast(first + begin, first + end); });
    // In block order, so that the sums are the same however many blocks are cast at a time.
    for (int64_t block = 0; block < (count + block_size - 1) / block_size; ++block) {
      const BlockSums& sum = sums[block];
      totals.mean_loss.color += sum.loss.color / rays.size();
      totals.mean_loss.opacity += sum.loss.opacity / rays.size();
      totals.mean_loss.quantile += sum.loss.quantile / rays.size();
      totals.mean_loss.identity += sum.loss.identity / rays.size();
      for (size_t k = 0; k < sum.weight_gradient.size(); ++k) {
        result->classifier_weight_gradient[k] += sum.weight_gradient[k];
      }
      for (size_t k = 0; k < sum.bias_gradient.size(); ++k) {
        result->classifier_bias_gradient[k] += sum.bias_gradient[k];
      }
      totals.step_limit_hits += sum.step_limit_hits;
      totals.num_segments += sum.num_segments;
      totals.clamped_segments += sum.clamped_segments;
    }
  }
}

}  // namespace semfoam
