// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/optim/training_device.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_caster.h"
#include "foam/train/camera_cells.h"
#include "foam/train/training_pixels.h"
#include "foam/train/training_schedule.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

// Measures how well a foam in training reproduces photos.

namespace semfoam {

// Returns the sum over the rays of the squared difference between the rendered colour, clipped at
// white, and the target's. `rendered` [rays] belongs to `rays`.
double SquaredError(const std::vector<BatchRay>& rays, const std::vector<RenderedRay>& rendered);

// The quality of held-out views. NaN = not known.
struct HeldOutQuality {
  // Peak signal-to-noise ratio in dB, mean over the views.
  double psnr = NAN;
  // Mean intersection over union (LabelAgreement) of rendered and photographed classes.
  double miou = NAN;
};

// Evaluates the held-out views kNumEvaluations times over the run.
class HeldOutEvaluator {
 public:
  // All arguments must outlive this object.
  HeldOutEvaluator(const TrainingViews& views,
                   const TrainingSchedule& schedule,
                   const TrainingPixels& pixels,
                   const CameraCells& camera_cells,
                   const TrainingState& state,
                   TrainingDevice* device);

  // Renders TrainingPixels::HeldOutPixels() on the device and returns their quality, if an
  // evaluation is due after `iteration` iterations. Reads only sizes of the host's state.
  std::optional<HeldOutQuality> EvaluateIfDue(int64_t iteration);

  // Returns the seconds that all evaluations have taken.
  double seconds() const { return seconds_; }

  // Describes the numbers (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("evaluations", &num_evaluations_);
    archive->Number("seconds_evaluating", &seconds_);
  }

 private:
  HeldOutQuality Evaluate() const;

  const TrainingViews& views_;
  const TrainingSchedule& schedule_;
  const TrainingPixels& pixels_;
  const CameraCells& camera_cells_;
  const TrainingState& state_;
  TrainingDevice* const device_;
  // Number of evaluations that were due so far, of which one alone is made at a time.
  int num_evaluations_ = 0;
  double seconds_ = 0;
};

}  // namespace semfoam
