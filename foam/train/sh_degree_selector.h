// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/train/camera_cells.h"
#include "foam/train/training_options.h"
#include "foam/train/training_pixels.h"
#include "foam/train/training_schedule.h"

#include <cstdint>

// Which degree of spherical harmonics a training uses.

namespace semfoam {

// Raises the SH degree in the course of a run, while it pays. The run starts at degree 0; degree d
// is added at d tenths of the run. A tenth later it must have paid, or it is taken out again and
// the degree is settled: without it, the squared error of the colours must be greater by 1 % on the
// probes, which training has not seen until then. Without probes every degree up to
// TrainingOptions::sh_degree stays.
class ShDegreeSelector {
 public:
  // All arguments must outlive this.
  ShDegreeSelector(const TrainingOptions& options,
                   const TrainingSchedule& schedule,
                   const CameraCells& camera_cells,
                   TrainingPixels* pixels,
                   TrainingState* state,
                   TrainingDevice* device);

  // Takes the decision that is due after so many iterations, if any: changes the degree on host and
  // device by one at most, and releases the probes when it is settled. To be called after every
  // iteration.
  void Update(int64_t iteration);

  // Returns whether the degree may be settled by then, so that probes are trained on, as far as
  // that is known ahead.
  ProbeUse ProbeUseAt(int64_t iteration) const;

  // Releases the probes if the degree that Serialize has read is settled.
  void Restore();

  // Describes the numbers (checkpoint_state.h); the degree itself is the foam's.
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
