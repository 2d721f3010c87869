// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/gradient_sum.h"
#include "foam/ray_loss.h"
#include "foam/ray_record.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// One ray of a batch: where it starts and what it should show.
struct BatchRay {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;
  uint32_t start_cell = 0;
  float quantile_tau[kNumQuantiles] = {};  // -ln(q), ascending
  RayTarget target;
};

// The part of a ray's gradient that all its cells share (see CellContribution).
struct RayOutput {
  float color_gradient[3];
  float identity_gradient[kIdentityDim];
  float sh_basis[kMaxShCoefficients];
};

// What casting a batch leaves behind. Reused from batch to batch.
struct BatchResult {
  GradientSum gradients;                          // not grouped yet
  std::vector<RayOutput> rays;                    // [batch size]
  std::vector<float> classifier_weight_gradient;  // [K][kIdentityDim], mean over the batch
  std::vector<float> classifier_bias_gradient;    // [K]
  RayLossTerms<double> mean_loss;                 // unweighted terms, mean over the batch
  int64_t step_limit_hits = 0;
  int64_t num_pieces = 0;  // cells walked through
};

// Casts all rays forward and backward, in parallel. Gradients are of the mean loss over the batch,
// with each term weighted. `cutoff_tau`: rays stop at this optical depth. The result does not
// depend on the number of threads.
void CastBatch(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               const ClassifierView<float>& classifier,
               const RayLossWeights& weights,
               float cutoff_tau,
               const std::vector<BatchRay>& rays,
               BatchResult* result);

}  // namespace semfoam
