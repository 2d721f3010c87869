// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/color_variation.h"
#include "foam/render/ray_batch.h"
#include "foam/render/update_loops.h"
#include "foam/util/host_device.h"
#include "foam/util/large_pages.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace semfoam {

// Learning rates of one step.
struct LearningRates {
  // In units of StepLengths::position; 0: frozen.
  float position = 0;
  // Of the raw density.
  float density = 0;
  float sh_dc = 0;
  float sh_rest = 0;
  // In units of StepLengths::color_gradient.
  float color_gradient = 0;
  float identity = 0;
  float classifier = 0;
};

// The lengths that a cell's changes of position and of colour gradient are measured in (normalised
// frame).
struct StepLengths {
  // The site moves by this at a position rate of 1.
  float position = 0;
  // A step of 1 of the colour gradient changes the colour by 1 over this. Infinity: no gradient.
  float color_gradient = 0;
};

// Returns the step lengths of a cell of this radius (CellRadii): the radius, within bounds, so that
// a small thing seen from afar trains like a large one from near, and the large cells of a
// background find their places too. Photos show a very large cell from few sides: a colour gradient
// would fit each of them and not what lies between, so its steps fall with the radius. A cell next
// to a guard, `is_open`, has no end within the scene, and a linear colour no bound within the cell.
StepLengths StepLengthsOf(float radius, bool is_open);

// Largest change of colour by a colour gradient over its step length.
inline constexpr float kLargestColorChange = 0.3f;

// Adds a row of changes to the colour gradient of a cell, in units of its step length.
SEMFOAM_HOST_DEVICE inline void StepColorGradient(const float* change,
                                                  float step_length,
                                                  float* color_gradient) {
  const float per_length = 1 / step_length, largest = kLargestColorChange * per_length;
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

  // `is_frozen` [N], or empty: these are neither pruned nor divided.
  void Reset(size_t num_sites, const std::vector<uint8_t>& is_frozen = {}) {
    squared_error.assign(num_sites, 0.f);
    contribution.assign(num_sites, 0.f);
    for (size_t i = 0; i < is_frozen.size(); ++i) contribution[i] = is_frozen[i];
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

// Writes the rows that ColorGraph compares to `rows` [N][kSurfaceColorDim]. `density` [N or more]
// is activated; a cell's radius is its StepLengths::position.
void CollectSurfaceColors(const Foam& foam,
                          const std::vector<float>& density,
                          const std::vector<StepLengths>& step_lengths,
                          std::vector<float>* rows);

// Returns the bias corrections of Adam's moments, by step; the last one, which is 1, is used for
// all later steps.
const std::vector<AdamCorrection>& AdamCorrections();

// Optimises all parameters of a foam with Adam (Kingma and Ba 2015). A cell that no ray of the
// batch crossed keeps its parameters and moments: with about 1e4 rays a step, most cells are idle
// in most steps, and momentum would move them without evidence. Each cell counts its own steps for
// the bias correction, so that new cells start with it too.
class FoamOptimizer {
 public:
  // Cells with `is_frozen` [N] keep their parameters and have no moments; empty: none is.
  explicit FoamOptimizer(const Foam& foam, const std::vector<uint8_t>& is_frozen = {});

  // Takes one step with the batch's gradients, which it groups by cell. `tv_gradient` is
  // [N][kIdentityDim], or empty. Cells that rays have crossed also get the gradient of the colours'
  // variation over `color_graph`, where there is one. `sites` [N or more] are the positions that
  // the rays met. Cells with `is_clear` [N] keep their density. Updates `density` [N or more], the
  // activated densities. A cell with a gradient that is not finite keeps its parameters; returns
  // the number of such cells.
  int64_t Step(BatchResult* batch,
               const std::vector<float>& tv_gradient,
               const ColorGraph& color_graph,
               const std::vector<Eigen::Vector3f>& sites,
               const std::vector<uint8_t>& is_clear,
               const std::vector<StepLengths>& step_lengths,
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
  // origin[k], or zeros where is_new[k]. It is frozen where that is.
  void Rearrange(const std::vector<uint32_t>& origin, const std::vector<uint8_t>& is_new);

  // Changes the SH degree of the moments; those of new coefficients are zero.
  void ChangeShDegree(int degree);

  // Describes the moments and counts of the cells that are not frozen, in their order
  // (foam/train/checkpoint_state.h), for a foam of the same sizes.
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
  // memory. No cell may be frozen.
  const ParameterRow& row() const { return row_; }
  LargePageVector<float>& first_moments() { return first_; }
  LargePageVector<float>& second_moments() { return second_; }
  std::vector<uint32_t>& steps() { return steps_; }

 private:
  // In moments_of_: the cell is frozen.
  static constexpr uint32_t kNoMoments = std::numeric_limits<uint32_t>::max();

  // Returns which of the moments and counts are the site's, or kNoMoments.
  uint32_t MomentsOf(size_t site) const {
    return moments_of_.empty() ? static_cast<uint32_t>(site) : moments_of_[site];
  }

  // Starts to load what Step reads and writes of a cell that rays have crossed.
  void PrefetchCell(size_t site, const Foam& foam) const;

  int sh_degree_;
  ParameterRow row_;
  // Length of a site's row.
  int stride_;
  // [N] MomentsOf(); empty: each site's are its own. M of the sites are not frozen.
  std::vector<uint32_t> moments_of_;
  // [M][stride_] First and second moments.
  LargePageVector<float> first_;
  LargePageVector<float> second_;
  // [M] Number of steps of each site.
  std::vector<uint32_t> steps_;
  // Moments of the weights [K][kIdentityDim], then of the biases [K].
  std::vector<float> classifier_first_;
  std::vector<float> classifier_second_;
  uint32_t classifier_steps_ = 0;
};

}  // namespace semfoam
