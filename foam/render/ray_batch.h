// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/spherical_harmonics.h"
#include "foam/render/compositing.h"
#include "foam/render/gradient_sum.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/host_device.h"
#include "foam/util/large_pages.h"
#include "foam/util/rank_group.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// One ray of a batch, in the normalised frame, with its targets.
struct BatchRay {
  Eigen::Vector3f origin;
  // Unit length.
  Eigen::Vector3f direction;
  // The cell nearest to the origin.
  uint32_t start_cell = 0;
  // Optical depths of the depth quantiles, -ln(q), ascending.
  float quantile_tau[kNumQuantiles] = {};
  RayTarget target;
};

// The order of a cell's parameters in one row, as gradients and moments hold them: identity (only
// with semantics), position, raw density, colour gradient (where there is one), SH; then zeros, up
// to a multiple of four.
struct ParameterRow {
  static constexpr int kMaxSize =
      (kIdentityDim + 4 + kColorGradientDim + 3 * kMaxShCoefficients + 3) / 4 * 4;

  ParameterRow(int sh_degree, bool has_semantics, bool has_color_gradient)
      : position(has_semantics ? kIdentityDim : 0),
        density(position + 3),
        color_gradient(position + 4),
        sh(color_gradient + (has_color_gradient ? kColorGradientDim : 0)),
        size((sh + 3 * NumShCoefficients(sh_degree) + 3) / 4 * 4) {}

  bool HasSemantics() const { return position > 0; }
  SEMFOAM_HOST_DEVICE bool HasColorGradient() const { return sh > color_gradient; }

  // Offsets of the parameters; the identity begins at 0.
  int position;
  int density;
  int color_gradient;
  int sh;
  // Length of the row.
  int size;
};

// A range of a ParameterRow.
struct ParameterSpan {
  int begin, end;
};

// Returns the parameters of a cell that one step changes. Records of negligible weight
// (kNegligibleWeight) have no gradient by identity, colour gradient and SH above degree 0; the
// total variation has one by the identity alone.
SEMFOAM_HOST_DEVICE inline ParameterSpan ParametersToStep(const ParameterRow& row,
                                                          bool has_records,
                                                          float largest_weight,
                                                          bool has_variation) {
  if (!has_records) return {0, has_variation ? row.position : 0};
  if (largest_weight > kNegligibleWeight) return {0, row.size};
  return {has_variation ? 0 : row.position, row.sh + 3};
}

// Multiplies the derivatives by everything that a ray accumulates.
SEMFOAM_HOST_DEVICE inline void ScaleGradient(float factor, RayGradient<float>* gradient) {
  for (float& g : gradient->color) g *= factor;
  gradient->opacity *= factor;
  for (float& g : gradient->quantile_depth) g *= factor;
  for (float& g : gradient->identity) g *= factor;
}

// The part of a ray's gradient that all its cells share (see CellContribution): the derivatives of
// the loss by the identity and the SH coefficients of a cell of weight 1, as a ParameterRow with
// zeros in place of position, density and colour gradient; and the ray itself.
struct RayOutput {
  alignas(64) float parameters[(ParameterRow::kMaxSize + 15) / 16 * 16];
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;

  // Writes row.size values. `sh_basis` has `num_coefficients` values, of the ray's direction.
  SEMFOAM_HOST_DEVICE void Set(const ParameterRow& row,
                               const RayGradient<float>& gradient,
                               const float* sh_basis,
                               int num_coefficients) {
    for (int k = 0; k < row.position; ++k) parameters[k] = gradient.identity[k];
    for (int k = row.position; k < row.sh; ++k) parameters[k] = 0;
    for (int k = 0; k < num_coefficients; ++k) {
      for (int c = 0; c < 3; ++c) {
        parameters[row.sh + 3 * k + c] = gradient.color[c] * sh_basis[k];
      }
    }
    for (int k = row.sh + 3 * num_coefficients; k < row.size; ++k) parameters[k] = 0;
  }
};

// Totals of a batch.
struct BatchTotals {
  // Unweighted terms, mean over the batch; those of rays led astray (IsAstray) count as 0.
  RayLossTerms<double> mean_loss;
  int64_t step_limit_hits = 0;
  // Number of cells walked through.
  int64_t num_segments = 0;
  // Number of these that a ray left before it entered them (see Walk).
  int64_t clamped_segments = 0;
};

// The result of casting a batch. Reused from batch to batch.
struct BatchResult {
  // Not grouped yet.
  GradientSum gradients;
  // [batch size]
  LargePageVector<RayOutput> rays;
  // [K][kIdentityDim] and [K], means over the batch.
  std::vector<float> classifier_weight_gradient;
  std::vector<float> classifier_bias_gradient;
  BatchTotals totals;
  // What this rank has sent to others; empty where there are none.
  std::vector<std::byte> sent;
};

// Returns the memory that CastBatch takes for the gradients of `num_classes` classes, in bytes.
int64_t ClassGradientBytes(int num_classes);

// Casts all rays forward and backward, in parallel. Gradients are of the mean loss over the batch,
// each term weighted by `weights`. Rays stop at the optical depth `cutoff_tau`. The result does not
// depend on the number of threads. With `ranks`, all of which must pass the same, each casts a part
// of the rays, and all have the same result as one process; throws LostRank.
void CastBatch(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               const ClassifierView<float>& classifier,
               const RayLossWeights& weights,
               float cutoff_tau,
               const std::vector<BatchRay>& rays,
               BatchResult* result,
               RankGroup* ranks = nullptr);

}  // namespace semfoam
