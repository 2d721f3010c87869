// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/device/device.h"
#include "foam/model/foam.h"
#include "foam/train/checkpoint.h"
#include "foam/train/training_options.h"
#include "foam/util/device_kind.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace semfoam {

class TrainingDevice;
struct TrainingState;

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
  int64_t segments = 0;         // cells walked through, over all training rays
  int64_t step_limit_hits = 0;  // rays cut by the walk's step limit: 0 in a healthy run
  int64_t triangulations = 0;
  double seconds_triangulating = 0;   // for which iterations waited
  int triangulation_lag = 0;          // iterations that went on meanwhile (TrainingDevice)
  int64_t nonfinite_gradients = 0;    // updates skipped because a gradient was not finite
  int64_t nonfinite_pixels = 0;       // drawn and left out because their colour is not finite
  int64_t unstable_iterations = 0;    // see TrainingGuard: a run that recovered
  double explained_contrast = NAN;    // see TrainingGuard: of the training photos, at the end
  std::vector<TrainingProgress> log;  // all reports

  std::string BriefReport() const;  // one line
};

// What happens around the iterations of a run. Each may be empty.
struct TrainingHooks {
  std::function<void(const TrainingProgress&)> report;  // about once a second and at the end

  // Called after every iteration but the last, with the number of those done. `save` adds the state
  // of the run to a checkpoint's contents, which is to be written before the hook returns. What the
  // hook throws ends the run.
  using Save = std::function<void(CheckpointContents*)>;
  std::function<void(int64_t iteration, const Save& save)> between_iterations;

  // The run goes on from there, and ends with the same bytes as if it had never stopped: on the
  // same views, seeds, number of classes (the caller's to know), options and kind of device, and
  // with any number of threads. Seconds go on from those of the checkpoint.
  std::unique_ptr<const Checkpoint> resume_from;

  // Where to train, and to render what is measured of the trained foam.
  Device device;

  // Makes what trains in place of `device`, for tests; empty: MakeTrainingDevice.
  std::function<std::unique_ptr<TrainingDevice>(TrainingState*)> make_device;
};

// Throws UserError, one sentence, where the checkpoint is of a run on another kind of device: going
// on there would end with other bytes. One that does not say is of the CPU. TrainFoam asks it of
// its device; for those who want to know before they load what it trains on.
void RequireSameDevice(const Checkpoint& checkpoint, DeviceKind device);

// Trains a foam on the views that are not held out. `num_classes` = 0 trains colour only.
// Deterministic in (views, seeds, num_classes, options) and the kind of device, whatever the number
// of threads. Throws UserError where the views hold nothing to train on, the options are out of
// range, the run is lost (training_guard.h), or the checkpoint is none of a run like this one.
// Pixels whose colour is not finite are left out. Views that do not hold their pixels are read
// first, and again where their memory asks for it (foam/data/pixel_cache.h); the bytes are the
// same.
TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          TrainingHooks hooks);
// Trains on `device`, without a checkpoint.
TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          const std::function<void(const TrainingProgress&)>& report,
                          const Device& device = {});

}  // namespace semfoam
