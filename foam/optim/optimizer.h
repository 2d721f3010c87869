// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/ray_batch.h"
#include "foam/render/update_loops.h"
#include "foam/util/host_device.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Learning rates of one step.
struct LearningRates {
  // In units of the cell's radius; 0: frozen.
  float position = 0;
  // Of the raw density.
  float density = 0;
  float sh_dc = 0;
  float sh_rest = 0;
  // Of the change of colour over a cell's radius.
  float color_gradient = 0;
  float identity = 0;
  float classifier = 0;
};

// Returns the length by which a site moves at a position rate of 1: its cell's radius within these
// bounds, so that a small thing seen from afar trains like a large one from near, and the large
// cells of a background find their places too.
SEMFOAM_HOST_DEVICE inline float StepLength(float radius) {
  constexpr float kSmallest = 5e-4f, kLargest = 0.1f;
  return radius < kSmallest ? kSmallest : radius > kLargest ? kLargest : radius;
}

// Adds a row of changes to the colour gradient of a cell, in units of its learning rate: a step of 1
// changes the colour by 1 over the cell's radius, and all steps together by no more than
// kLargestColorChange. Beyond kLargestTexturedRadius both fall with the radius: photos show so large
// a cell from few sides, and a gradient would only fit each of them, not what lies between.
inline constexpr float kLargestColorChange = 0.3f;
inline constexpr float kLargestTexturedRadius = 0.02f;
SEMFOAM_HOST_DEVICE inline void StepColorGradient(const float* change,
                                                  float radius,
                                                  float* color_gradient) {
  constexpr float kSmallest = 5e-4f;
  float length = radius < kSmallest ? kSmallest : radius;
  if (length > kLargestTexturedRadius) length *= length / kLargestTexturedRadius;
  const float per_length = 1 / length, largest = kLargestColorChange * per_length;
  for (int k = 0; k < kColorGradientDim; ++k) {
    const float next = color_gradient[k] + per_length * change[k];
    color_gradient[k] = next < -largest ? -largest : next > largest ? largest : next;
  }
}

// Statistics of all cells for the next densification, accumulated over the training rays since the
// last one.
struct DensificationStatistics {
  // [N] Sum over all rays of weight |dL/dcolour|^2.
  std::vector<float> squared_error;
  // [N] Largest rendering weight over all rays.
  std::vector<float> contribution;

  void Reset(size_t num_sites) {
    squared_error.assign(num_sites, 0.f);
    contribution.assign(num_sites, 0.f);
  }
};

// Minimum raw density of a cell: below it the gradient nearly vanishes, so that training could not
// make the cell opaque again (Radiant Foam's "transparent" value).
inline constexpr float kLowestRawDensity = -1;
// Raw density of cells that are known to be empty: its density is below kTransparentDensity, so
// that no ray shades them.
inline constexpr float kTransparentRawDensity = -2;

// Returns the raw density clamped to the range of its cell; `is_clear`: the cell lies in free
// space.
SEMFOAM_HOST_DEVICE inline float ClampedRawDensity(float raw, bool is_clear) {
  if (is_clear) return kTransparentRawDensity;
  return raw < kLowestRawDensity ? kLowestRawDensity : raw;
}

// Returns the bias corrections of Adam's moments, by step; the last one, which is 1, is used for
// all later steps.
const std::vector<AdamCorrection>& AdamCorrections();

// Optimises all parameters of a foam with Adam (Kingma and Ba 2015). A cell that no ray of the
// batch crossed keeps its parameters and moments: with about 1e4 rays a step, most cells are idle
// in most steps, and momentum would move them without evidence. Each cell counts its own steps for
// the bias correction, so that new cells start with it too.
class FoamOptimizer {
 public:
  explicit FoamOptimizer(const Foam& foam);

  // Takes one step with the batch's gradients, which it groups by cell. `tv_gradient` is
  // [N][kIdentityDim], or empty. `sites` [N or more] are the positions that the rays met. Cells with
  // `is_clear` [N] keep their density; sites move by steps in proportion to their cell's `radius`
  // [N], colour gradients by steps in proportion to its inverse. Updates `density` [N or more], the activated
  // densities. A cell with a gradient that is not finite keeps its parameters; returns the number
  // of such cells.
  int64_t Step(BatchResult* batch,
               const std::vector<float>& tv_gradient,
               const std::vector<Eigen::Vector3f>& sites,
               const std::vector<uint8_t>& is_clear,
               const std::vector<float>& radius,
               const LearningRates& rates,
               Foam* foam,
               std::vector<float>* density,
               DensificationStatistics* statistics);

  // Takes the classifier's part of Step: its weights [K][kIdentityDim], then its biases [K].
  // Returns how many of the two kept their parameters because of a gradient that is not finite.
  int64_t StepClassifier(const std::vector<float>& weight_gradient,
                         const std::vector<float>& bias_gradient,
                         float rate,
                         Foam* foam);

  // Rearranges the moments after a densification: new site k takes the moments of old site
  // origin[k], or zeros where is_new[k].
  void Rearrange(const std::vector<uint32_t>& origin, const std::vector<uint8_t>& is_new);

  // Changes the SH degree of the moments; those of new coefficients are zero.
  void ChangeShDegree(int degree);

  // Describes the moments and counts (foam/train/checkpoint_state.h), for a foam of the same sizes.
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Array("first_moments", &first_, first_.size());
    archive->Array("second_moments", &second_, second_.size());
    archive->Array("steps", &steps_, steps_.size());
    archive->Array("classifier_first_moments", &classifier_first_, classifier_first_.size());
    archive->Array("classifier_second_moments", &classifier_second_, classifier_second_.size());
    archive->Number("classifier_steps", &classifier_steps_);
  }

  // Give access to the moments, rows [N][row().size], for a device that keeps them in its own
  // memory.
  const ParameterRow& row() const { return row_; }
  std::vector<float>& first_moments() { return first_; }
  std::vector<float>& second_moments() { return second_; }
  std::vector<uint32_t>& steps() { return steps_; }

 private:
  int sh_degree_;
  ParameterRow row_;
  // Length of a site's row.
  int stride_;
  // [N][stride_] First and second moments.
  std::vector<float> first_;
  std::vector<float> second_;
  // [N] Number of steps of each site.
  std::vector<uint32_t> steps_;
  // Moments of the weights [K][kIdentityDim], then of the biases [K].
  std::vector<float> classifier_first_;
  std::vector<float> classifier_second_;
  uint32_t classifier_steps_ = 0;
};

}  // namespace semfoam
