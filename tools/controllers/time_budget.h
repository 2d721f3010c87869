// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// The presets as a line: the options of a run of `num_rays` rays. Between two presets the sizes of
// batch and foam and the densifications lie between theirs, in ratios (halfway from 4 to 30 M rays
// is 11 M); the SH degree and all else are the nearer one's. Below the quickest preset the line
// goes on as between the first two, above the best with its own values. CHECKs num_rays > 0.
TrainingOptions OptionsOnPresetLine(int64_t num_rays);

// How long TrainFoam takes on these views on a device of this machine, learned from two short runs:
// of some 0.2 M rays, and of what then seems to fill `seconds` (left out where that is hardly
// more). They train colour and classes of a few of the views, from start to end, because the cost
// of a ray changes as a foam becomes solid. The estimate is for the same views and a machine as
// busy as now; a factor of 1.5 either way is normal far from the presets' line.
class TrainingTimeModel {
 public:
  // Throws what TrainFoam throws.
  TrainingTimeModel(const TrainingViews& views,
                    const std::vector<SeedPoint>& seeds,
                    int num_classes,
                    const Device& device,
                    double seconds);

  // Of TrainFoam.
  double TrainingSeconds(const TrainingOptions& options) const;
  // From there to the labels that foam_trainer writes: topology, objects, the photos that show
  // them, files.
  double ClosingSeconds(const TrainingOptions& options) const;

  // On the presets' line, the rays that TrainingSeconds and ClosingSeconds together fill `seconds`
  // with, to three digits.
  int64_t RaysOnPresetLine(double seconds) const;

 private:
  int64_t forward_rays_;
  double object_rays_ = 0;  // with which photos are looked at for objects
  // Seconds a ray, in a foam that grows to one site.
  double learning_ = 0;
  double looking_ = 0;
};

}  // namespace semfoam
