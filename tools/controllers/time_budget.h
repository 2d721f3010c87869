// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "foam/util/rank_group.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Returns the options of a run of `num_rays` rays, interpolated between the presets. The sizes of
// batch and foam and the number of densifications are interpolated in ratios (halfway from 4 to 30
// M rays is 11 M); the SH degree and all other options are those of the nearer preset. Below the
// fastest preset, extrapolates from the first two; above the best, uses its values. CHECKs num_rays
// > 0.
TrainingOptions OptionsOnPresetLine(int64_t num_rays);

// Estimates the time of TrainFoam on these views on a device of this machine, from two short runs:
// of about 0.2 M rays, and of the number that then seems to fill `seconds` (left out if that is
// barely more). They train colour and classes of a few of the views, from start to end, because the
// cost of a ray changes as cells become opaque. The estimate assumes the same views and the same
// load of the machine; far from the interpolated presets an error of a factor of 1.5 is normal.
class TrainingTimeModel {
 public:
  // Throws what TrainFoam throws. `views` must outlive this object. Where several ranks train
  // (`ranks`, on the CPU), all have the times of rank 0; null: this process alone.
  TrainingTimeModel(const TrainingViews& views,
                    const std::vector<SeedPoint>& seeds,
                    int num_classes,
                    const Device& device,
                    double seconds,
                    RankGroup* ranks = nullptr);

  // Returns the estimated seconds of TrainFoam.
  double TrainingSeconds(const TrainingOptions& options) const;
  // Returns the estimated seconds from there to the labels that foam_trainer writes: topology,
  // objects, the photos that show them, files.
  double ClosingSeconds(const TrainingOptions& options) const;

  // Returns the seconds that StartingSeeds took, the last time: hardly any without a dense cloud.
  double SeedingSeconds() const { return seeding_; }

  // Returns the number of rays, to three digits, for which TrainingSeconds and ClosingSeconds of
  // OptionsOnPresetLine add up to `seconds`.
  int64_t RaysOnPresetLine(double seconds) const;

 private:
  const TrainingViews& views_;
  // Number of rays that find the photos of the objects.
  double object_rays_ = 0;
  // Seconds per ray, in a foam that grows to one site.
  double learning_ = 0;
  double looking_ = 0;
  double seeding_ = 0;
};

}  // namespace semfoam
