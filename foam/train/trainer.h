// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"
#include "foam/device/device.h"
#include "foam/model/foam.h"
#include "foam/render/ray_caster.h"
#include "foam/train/checkpoint.h"
#include "foam/train/hidden_cells.h"
#include "foam/train/label_spreading.h"
#include "foam/train/training_options.h"
#include "foam/util/device_kind.h"
#include "foam/view/cell_statistics.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

class TrainingDevice;
struct TrainingState;

// The progress of a run. NaN: not known.
struct TrainingProgress {
  // Number of iterations done, and of all iterations.
  int64_t iteration = 0;
  int64_t num_iterations = 0;
  // Number of rays cast so far.
  int64_t rays = 0;
  int64_t sites = 0;
  // Number of photos read, and of all photos to read, while photos that do not fit into memory are
  // read; otherwise 0.
  int photos_read = 0;
  int photos_to_read = 0;
  // Seconds since the start of training, and an estimate of the seconds to its end.
  double seconds = 0;
  double seconds_left = 0;
  // Mean losses since the last report.
  double color_loss = NAN;
  double opacity_loss = NAN;
  double quantile_loss = NAN;
  double identity_loss = NAN;
  double tv_loss = NAN;
  double distance_loss = NAN;
  // Quality on a grid of the held-out views' pixels at the last evaluation: PSNR in dB, and mean
  // IoU against the views' classes (LabelAgreement).
  double held_out_psnr = NAN;
  double held_out_miou = NAN;
};

// The result of a run.
struct TrainingSummary {
  Foam foam;
  CellStatistics statistics;
  TrainingProgress last;
  // TrainingOptions::late_rays, or the number that was chosen for TrainingOptions::seconds.
  int64_t late_rays = 0;
  // Number of cells walked through by all training rays.
  int64_t segments = 0;
  // Number of rays cut by the walk's step limit: 0 in a healthy run.
  int64_t step_limit_hits = 0;
  int64_t triangulations = 0;
  // Seconds that iterations waited for triangulations.
  double seconds_triangulating = 0;
  // Number of iterations that ran during a triangulation (TrainingDevice::TriangulationLag).
  int triangulation_lag = 0;
  // Number of updates skipped because a gradient was not finite.
  int64_t nonfinite_gradients = 0;
  // Number of drawn pixels left out because their colour is not finite.
  int64_t nonfinite_pixels = 0;
  // TrainingGuard::unstable_iterations of a run that recovered.
  int64_t unstable_iterations = 0;
  // TrainingGuard::explained_contrast at the end.
  double explained_contrast = NAN;
  HiddenCellChanges hidden_cells;
  // Number of cells that were made transparent because they hung before cameras
  // (foam/train/hanging_cells.h); one that has become opaque again, and was found again, counts
  // again.
  int64_t hanging_cells = 0;
  // How labels were spread; without a value they were not, as enough views have labels.
  std::optional<SpreadingResult> spreading;
  // All reports.
  std::vector<TrainingProgress> log;

  // Returns one line about the result.
  std::string BriefReport() const;
};

// Fractions of the run after which TrainingHooks::adapt_views is called. By the first, a foam shows
// the colours of surfaces; by the last, it has taken up nearly all of a change.
inline constexpr double kViewAdaptations[] = {0.15, 0.35, 0.6};

// Fractions of the run after which cells that hang before cameras are made transparent: once walls
// have formed, and early enough for these to take over what the cells have explained.
inline constexpr double kHangingCellSearches[] = {0.4, 0.6, 0.8, 0.95};

// Functions called in the course of a run, and where it runs. All may be empty.
struct TrainingHooks {
  // Called about once a second and at the end.
  std::function<void(const TrainingProgress&)> report;

  // Called after every iteration but the last, with the number of those done. `save` adds the state
  // of the run to a checkpoint's contents, which is to be written before the hook returns. What the
  // hook throws ends the run. Called once more where another rank is lost, in an iteration or while
  // ranks compare their foams, before LostRank ends the run; what it saves then is that of the
  // number of iterations that it is given, which may be 0.
  using Save = std::function<void(CheckpointContents*)>;
  std::function<void(int64_t iteration, const Save& save)> between_iterations;

  // Called at the fractions kViewAdaptations of the run, so that the caller can compare the
  // foam with the photos and change the colours, origins and directions that the views return from
  // then on; all else about the views must stay. `render` renders pixels with the foam as it is, to
  // be called within the hook only; a pixel without a ray has opacity 0.
  using RenderPixels =
      std::function<std::vector<RenderedRay>(const std::vector<ViewPixel>& pixels)>;
  std::function<void(const RenderPixels& render)> adapt_views;
  // The part of the run at whose fractions kViewAdaptations that is; > 0, 1: all of it.
  double adapted_part = 1;

  // Called after every iteration, with the number of those done and whether there is no other, so
  // that the caller can show the foam in training. Must not change the views.
  std::function<void(int64_t iteration, bool is_last, const RenderPixels& render)> preview;

  // Called where a run is resumed, before its first iteration: brings the views to the state in
  // which adapt_views had left them. What is computed of views before that is of those at the
  // beginning of the run, as it was when the run began.
  std::function<void()> restore_views;

  // The checkpoint to resume from; null: start a new run. The resumed run ends with the same bytes
  // as if it had never stopped, given the same views, seeds, number of classes, options and kind of
  // device, which the caller must ensure; the number of threads and ranks may differ. Seconds
  // continue from those of the checkpoint.
  std::unique_ptr<const Checkpoint> resume_from;

  // The rays by which the trained cells are measured (MeasureCells), and hidden ones completed.
  // With a part of them, cells that others meet are as if hidden.
  RayFilter measured_rays;

  // The device for the training and for the measurements of the trained foam.
  Device device;

  // Makes the training device, as one of several ranks (MakeCpuTrainingDevice) or for tests; empty:
  // MakeTrainingDevice of `device`.
  std::function<std::unique_ptr<TrainingDevice>(TrainingState*)> make_device;
};

// Throws UserError, one sentence, where the checkpoint is of a run on another kind of device, on
// which the run would end with other bytes. A checkpoint that does not name a kind is of the CPU.
// TrainFoam checks this itself; callers can check it before they load photos.
void RequireSameDevice(const Checkpoint& checkpoint, DeviceKind device);

// Returns the seeds from which a run with these options starts: all SfM points, and of a dense
// cloud (SeedPoint::is_dense) so many, thinned by voxels, that no more than PointSites(options)
// sites are at points. TrainFoam starts from these, whether it is called with `seeds` or with the
// result.
std::vector<SeedPoint> StartingSeeds(std::vector<SeedPoint> seeds, const TrainingOptions& options);

// Trains a foam on the views that are not held out. `num_classes` = 0 trains colour only. The
// result depends on (views, seeds, num_classes, options) and the kind of device alone, not on the
// number of threads or ranks (TrainingDevice::ranks); ranks must pass the same and resume from the
// same checkpoint, and all return the same. Throws LostRank where one has ended, and UserError
// where one has other numbers in its foam than rank 0. Throws UserError where the views have no
// pixel to train on, the options are out of range, the run is lost (training_guard.h), or the
// checkpoint is of a different run. Pixels whose colour is not finite are left out. Views that do
// not hold their pixels are read first, and again during the run if their pixels do not all fit
// into memory (foam/data/pixel_cache.h); the bytes are the same.
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
