// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/train/camera_cells.h"
#include "foam/train/training_options.h"
#include "foam/train/training_pixels.h"
#include "foam/train/training_schedule.h"

#include <cstdint>

// Chooses the degree of the spherical harmonics in the course of a training.

namespace semfoam {

// Raises the SH degree as long as that lowers the error. The run starts at degree 0; degree d is
// added at d intervals of the run (TrainingOptions::sh_degree_interval). An interval later, the
// degree stays if the squared error of the colours without it is greater by 1 % on the probes,
// pixels that training has not seen until then; otherwise it is removed and the degree is final.
// Without probes every degree up to TrainingOptions::sh_degree stays.
class ShDegreeSelector {
 public:
  // All arguments must outlive this object.
  ShDegreeSelector(const TrainingOptions& options,
                   const TrainingSchedule& schedule,
                   const CameraCells& camera_cells,
                   TrainingPixels* pixels,
                   TrainingState* state,
                   TrainingDevice* device);

  // Makes the decision that is due after `iteration` iterations, if any: changes the degree on host
  // and device by at most one, and releases the probes when the degree is final. Must be called
  // after every iteration.
  void Update(int64_t iteration);

  // Returns whether the degree may be final by then, so that training uses the probes, as far as
  // that is known in advance.
  ProbeUse ProbeUseAt(int64_t iteration) const;

  // Releases the probes if the degree that Serialize has read is final.
  void Restore();

  // Describes the numbers (checkpoint_state.h); the degree itself is part of the foam.
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("sh_degree_is_settled", &is_settled_);
  }

 private:
  bool HighestDegreePays() const;
  void SetDegree(int degree);
  void Settle(int degree);

  const TrainingOptions& options_;
  const TrainingSchedule& schedule_;
  const CameraCells& camera_cells_;
  TrainingPixels* const pixels_;
  TrainingState* const state_;
  TrainingDevice* const device_;
  bool is_settled_ = false;
};

}  // namespace semfoam
