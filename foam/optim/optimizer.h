// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/ray_batch.h"
#include "foam/render/update_loops.h"
#include "foam/util/host_device.h"

#include <cstdint>
#include <vector>

namespace semfoam {

struct LearningRates {
  float position = 0;  // of a cell's radius, per step; 0 = frozen
  float density = 0;   // of the raw density
  float sh_dc = 0;
  float sh_rest = 0;
  float identity = 0;
  float classifier = 0;
};

// Densification statistics of a cell, accumulated over the training rays since the last time
// it was asked.
struct DensificationStatistics {
  std::vector<float> squared_error;  // [N] sum over all rays of weight |dL/dcolour|^2
  std::vector<float> contribution;   // [N] largest rendering weight over all rays

  void Reset(size_t num_sites) {
    squared_error.assign(num_sites, 0.f);
    contribution.assign(num_sites, 0.f);
  }
};

// Below this raw density a cell's gradient has all but vanished and it could never come back
// (Radiant Foam's "transparent" value).
inline constexpr float kLowestRawDensity = -1;
// Of cells that are known to be empty: below kTransparentDensity, so that no ray shades them.
inline constexpr float kTransparentRawDensity = -2;

// The raw density of a cell as its topology allows it: `is_clear`, in free space.
SEMFOAM_HOST_DEVICE inline float HeldRawDensity(float raw, bool is_clear) {
  if (is_clear) return kTransparentRawDensity;
  return raw < kLowestRawDensity ? kLowestRawDensity : raw;
}

// Bias corrections of Adam's moments, by step; the last, which is 1, holds from there on.
const std::vector<AdamCorrection>& AdamCorrections();

// Adam (Kingma and Ba 2015) over all parameters of a foam. A cell that no ray of the batch touched
// is left alone, its moments too: with some 1e4 rays a step, most cells are idle in most steps, and
// momentum would push them blindly. Each cell counts its own steps for the bias correction, so a
// new cell starts as cautiously as the first ones did.
class FoamOptimizer {
 public:
  explicit FoamOptimizer(const Foam& foam);

  // One step with the batch's gradients (grouped by cell here). `tv_gradient` is
  // [N][kIdentityDim], or empty. Cells with `is_clear` [N] keep their density; sites
  // move by steps in proportion to their cell's `radius` [N]. `density` [N or
  // more] follows the foam's, activated. A cell with a gradient that is not finite keeps its
  // parameters; returns the number of such cells.
  int64_t Step(BatchResult* batch,
               const std::vector<float>& tv_gradient,
               const std::vector<uint8_t>& is_clear,
               const std::vector<float>& radius,
               const LearningRates& rates,
               Foam* foam,
               std::vector<float>* density,
               DensificationStatistics* statistics);

  // The classifier's part of Step: its weights [K][kIdentityDim], then its biases [K]. Returns how
  // many of the two had a gradient that is not finite, and kept their parameters.
  int64_t StepClassifier(const std::vector<float>& weight_gradient,
                         const std::vector<float>& bias_gradient,
                         float rate,
                         Foam* foam);

  // Follows the foam through a densification: new site k takes the moments of old site origin[k],
  // or starts from zero where is_new[k].
  void Rearrange(const std::vector<uint32_t>& origin, const std::vector<uint8_t>& is_new);

  // Follows the foam to another SH degree: moments of new coefficients start from zero.
  void ChangeShDegree(int degree);

  // The moments and counts (foam/train/checkpoint_state.h), for a foam like the one it was made
  // for.
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Array("first_moments", &first_, first_.size());
    archive->Array("second_moments", &second_, second_.size());
    archive->Array("steps", &steps_, steps_.size());
    archive->Array("classifier_first_moments", &classifier_first_, classifier_first_.size());
    archive->Array("classifier_second_moments", &classifier_second_, classifier_second_.size());
    archive->Number("classifier_steps", &classifier_steps_);
  }

  // For a device that has the sites' moments in its own memory, as rows [N][row().size].
  const ParameterRow& row() const { return row_; }
  std::vector<float>& first_moments() { return first_; }
  std::vector<float>& second_moments() { return second_; }
  std::vector<uint32_t>& steps() { return steps_; }

 private:
  int sh_degree_;
  ParameterRow row_;
  int stride_;                           // of a site's row
  std::vector<float> first_;             // [N][stride_] first moments
  std::vector<float> second_;            // [N][stride_] second moments
  std::vector<uint32_t> steps_;          // [N]
  std::vector<float> classifier_first_;  // weights [K][kIdentityDim], biases [K]
  std::vector<float> classifier_second_;
  uint32_t classifier_steps_ = 0;
};

}  // namespace semfoam
