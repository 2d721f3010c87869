// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/spherical_harmonics.h"
#include "foam/render/gradient_sum.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_tracer.h"

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

// The parameters of a cell in one row, as gradients and moments hold them: identity (only with
// semantics), position, raw density, SH; then zeros, up to a multiple of four.
struct ParameterRow {
  static constexpr int kMaxSize = kIdentityDim + 4 + 3 * kMaxShCoefficients;

  ParameterRow(int sh_degree, bool has_semantics)
      : position(has_semantics ? kIdentityDim : 0),
        density(position + 3),
        sh(position + 4),
        size((sh + 3 * NumShCoefficients(sh_degree) + 3) / 4 * 4) {}

  int position;  // where it begins; the identity begins at 0
  int density;
  int sh;
  int size;
};

// The part of a ray's gradient that all its cells share (see CellContribution): the derivatives of
// the loss by the identity and the SH coefficients of a cell of weight 1, as a ParameterRow with
// zeros in place of position and density.
struct RayOutput {
  alignas(64) float parameters[(ParameterRow::kMaxSize + 15) / 16 * 16];
};

// A batch in numbers.
struct BatchTotals {
  RayLossTerms<double> mean_loss;  // unweighted terms, mean over the batch
  int64_t step_limit_hits = 0;
  int64_t num_segments = 0;      // cells walked through
  int64_t clamped_segments = 0;  // of these, left before they were entered (see Walk)
};

// What casting a batch leaves behind. Reused from batch to batch.
struct BatchResult {
  GradientSum gradients;  // not grouped yet
  // [batch size]
  LargePageVector<RayOutput> rays;
  std::vector<float> classifier_weight_gradient;  // [K][kIdentityDim], mean over the batch
  std::vector<float> classifier_bias_gradient;    // [K]
  BatchTotals totals;
};

// Memory that CastBatch takes for the gradients of so many classes, in bytes.
int64_t ClassGradientBytes(int num_classes);

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
