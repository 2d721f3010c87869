// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/foam.h"
#include "foam/training_views.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// How a foam is trained. Lengths are of the normalised frame (the cameras' extent is about 1);
// schedules are fractions of the run. Constants of the papers that were tuned for 2e10 rays on a
// GPU are replaced by ones for 1e7 to 1e8 rays (foam/README.md).
struct TrainingOptions {
  // The work: fixed numbers, so that a preset gives the same bytes on every machine.
  int64_t num_rays = 40'000'000;  // over the whole run, > 0
  int rays_per_iteration = 8192;  // batch size, > 0
  int final_sites = 80'000;       // what densification grows to, >= 64
  int sh_degree = 2;              // 0..3

  uint64_t random_seed = 0;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// Where a run is. NaN = not known.
struct TrainingProgress {
  int64_t iteration = 0;  // iterations done
  int64_t num_iterations = 0;
  int64_t rays = 0;  // cast so far
  int64_t sites = 0;
  double seconds = 0;       // since the start of training
  double seconds_left = 0;  // estimate
  double color_loss = NAN;  // means since the last report
  double opacity_loss = NAN;
  double quantile_loss = NAN;
  double identity_loss = NAN;
  double tv_loss = NAN;
  double held_out_psnr = NAN;  // dB over the held-out views, as of the last evaluation
};

struct TrainingSummary {
  Foam foam;
  CellStatistics statistics;
  TrainingProgress last;
  int64_t step_limit_hits = 0;  // rays cut by the walk's step limit: 0 in a healthy run
  int64_t triangulations = 0;
  double seconds_triangulating = 0;
  int64_t nonfinite_gradients =
      0;  // parameters whose update was skipped because its gradient was not finite

  std::string BriefReport() const;  // one line
};

// Trains a foam on the views that are not held out. `num_classes` = 0 trains colour only. Calls
// `report` about once a second and at the end. Deterministic in (views, seeds, num_classes,
// options), whatever the number of threads. Throws UserError when there is nothing to train on.
TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          const std::function<void(const TrainingProgress&)>& report);

}  // namespace semfoam
