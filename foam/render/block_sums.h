// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/classifier.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_tracer.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Sums over the rays of a block that are no sums over cells. Those of a batch are added up in the
// order of its blocks.
struct BlockSums {
  RayLossTerms<double> loss;
  // [K][kIdentityDim] and [K]
  std::vector<float> weight_gradient;
  std::vector<float> bias_gradient;
  int64_t step_limit_hits = 0;
  int64_t num_segments = 0;
  int64_t clamped_segments = 0;

  void Clear(int num_classes) {
    loss = {};
    weight_gradient.assign(num_classes * kIdentityDim, 0.f);
    bias_gradient.assign(num_classes, 0.f);
    step_limit_hits = num_segments = clamped_segments = 0;
  }

  void AddCounts(const RayTrace& trace) {
    step_limit_hits += trace.hit_step_limit;
    num_segments += trace.num_segments;
    clamped_segments += trace.clamped.size();
  }
};

}  // namespace semfoam
