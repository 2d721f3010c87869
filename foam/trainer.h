// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/foam.h"
#include "foam/training_views.h"
#include "foam/view_renderer.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace semfoam {

// How a foam is trained. Lengths are of the normalised frame (the cameras' extent is about 1);
// times are fractions of the run. The papers' constants were tuned for 2e10 rays on a GPU; these
// are for 1e7 to 1e8 (foam/README.md).
struct TrainingOptions {
  // The work: fixed numbers, so that the speed of the machine changes no byte.
  int64_t num_rays = 30'000'000;  // over the whole run, > 0
  // Of these, the rays after `densify_until`; 0 = their share of num_rays. Schedules of that part
  // are stretched or shortened with it.
  int64_t late_rays = 0;
  int rays_per_iteration = 4096;  // batch size, > 0
  int initial_sites = 20'000;     // SfM points beyond this are thinned, >= 0
  int final_sites = 100'000;      // what densification grows to, >= 64
  int sh_degree = 2;              // 0..3, at most: raised while it pays on photos not seen
  bool fixed_sh_degree = false;   // raised to sh_degree whether it pays or not

  // Rays stop where this share of the light is left, > 0 and < 1.
  double transmittance_cutoff = kTransmittanceCutoff;

  // Weights of the loss terms (ray_loss.h, total_variation.h), >= 0. The colour term has weight 1.
  double opacity_weight = 0.002;
  double quantile_weight = 1e-4;
  double identity_weight = 1;
  double cell_identity_weight = 0;  // 0: classes are trained through rendered identities alone
  // The share of the identity loss's gradient that shapes densities and positions as well; 0..1.
  double identity_to_density = 0;
  double tv_weight = 2;

  // Learning rates at the start; each falls on a cosine to `final_rate` times that.
  double position_rate = 0.04;  // of a cell's radius
  double density_rate = 0.1;
  double color_rate = 2e-2;
  double sh_factor = 0.1;  // higher SH degrees learn at this times the colour rate
  double identity_rate = 2e-2;
  double classifier_rate = 5e-3;  // constant
  double final_rate = 0.1;

  double densify_from = 0.05;
  double densify_until = 0.6;
  int densify_events = 10;
  double freeze_positions = 0.9;  // from here on positions stay, and the topology is exact

  uint64_t random_seed = 0;

  // > 0: late_rays is chosen where densification ends, so that TrainFoam takes so many seconds.
  // Alone of all options it makes a run depend on the machine; the same options with 0 here and
  // TrainingSummary::late_rays give the same bytes.
  double seconds = 0;

  // An empty string, or one sentence that names the option out of range and its range.
  std::string Check() const;
};

// Where a run is. NaN = not known.
struct TrainingProgress {
  int64_t iteration = 0;  // iterations done
  int64_t num_iterations = 0;
  int64_t rays = 0;  // cast so far
  int64_t sites = 0;
  int photos_read = 0;      // while photos that do not fit into memory are read: so many of
  int photos_to_read = 0;   // these; else 0
  double seconds = 0;       // since the start of training
  double seconds_left = 0;  // estimate
  double color_loss = NAN;  // means since the last report
  double opacity_loss = NAN;
  double quantile_loss = NAN;
  double identity_loss = NAN;
  double tv_loss = NAN;
  double held_out_psnr =
      NAN;  // dB over a grid of the held-out views' pixels, as of the last evaluation
  double held_out_miou = NAN;  // on the same pixels, see LabelAgreement: against the views' classes
};

struct TrainingSummary {
  Foam foam;
  CellStatistics statistics;
  TrainingProgress last;
  int64_t late_rays = 0;        // as given, or as chosen for TrainingOptions::seconds
  int64_t pieces = 0;           // cells walked through, over all training rays
  int64_t step_limit_hits = 0;  // rays cut by the walk's step limit: 0 in a healthy run
  int64_t triangulations = 0;
  double seconds_triangulating = 0;
  int64_t nonfinite_gradients = 0;  // updates skipped because a gradient was not finite
  int64_t nonfinite_pixels = 0;     // drawn and left out because their colour is not finite
  int64_t unstable_iterations = 0;  // see TrainingGuard: a run that recovered
  double explained_contrast = NAN;  // see TrainingGuard: of the training photos, at the end

  std::string BriefReport() const;  // one line
};

// Sites that training begins with besides the SfM points: those that fill the space around, and
// those of the far background.
inline int ScatteredSites(const TrainingOptions& options) { return options.final_sites / 10; }
inline int FarSites(const TrainingOptions& options) { return options.final_sites / 40; }

// Rays that TrainFoam casts without learning from them: over the run for the progress of the
// held-out quality, and after it for the cells' statistics.
int64_t EvaluationRays(const TrainingViews& views);
int64_t StatisticsRays(const TrainingViews& views);

// Trains a foam on the views that are not held out. `num_classes` = 0 trains colour only. Calls
// `report` about once a second and at the end. Deterministic in (views, seeds, num_classes,
// options), whatever the number of threads. Throws UserError where the views hold nothing to train
// on, the options are out of range, or the run is lost (training_guard.h). Pixels whose colour is
// not finite are left out. Views that do not hold their pixels are read first, and again where
// their memory asks for it (pixel_cache.h); the bytes are the same.
TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          const std::function<void(const TrainingProgress&)>& report);

}  // namespace semfoam
