// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/trainer.h"

#include "foam/device/device_factory.h"
#include "foam/optim/initialization.h"
#include "foam/train/trainer_internal.h"
#include "foam/train/training_evaluation.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "foam/view/cell_statistics.h"
#include "foam/view/view_renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

namespace semfoam {
namespace {

// The regulariser touches every cell, the rays only some: it takes one step in so many, with so
// many times the weight.
constexpr int64_t kTvInterval = 4;

}  // namespace

Trainer::Trainer(const TrainingViews& views,
                 const std::vector<SeedPoint>& seeds,
                 const TrainingOptions& options,
                 const TrainingHooks& hooks)
    : views_(views),
      options_(options),
      views_to_train_on_(ViewsToTrainOn(views)),
      free_space_(views, seeds),
      schedule_(options),
      device_(hooks.make_device ? hooks.make_device(&state_)
                                : MakeTrainingDevice(hooks.device, &state_)) {
  ChooseViews();
  if (pixels_.size() == 0) {
    throw UserError(
        "There is no photo to train on: all are held out or missing; hold out fewer "
        "(--test_every).");
  }
}

void Trainer::Begin(const std::vector<SeedPoint>& seeds, int num_classes) {
  InitializationOptions initialization;
  initialization.max_seed_sites = std::min(options_.initial_sites, options_.final_sites);
  initialization.num_scattered = ScatteredSites(options_);
  initialization.num_far = FarSites(options_);
  initialization.sh_degree = 0;  // raised later
  initialization.num_classes = num_classes;
  initialization.seed = options_.random_seed;
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(views_.NumViews());
  for (int view = 0; view < views_.NumViews(); ++view) centers.push_back(views_.Origin(view));
  state_.foam = InitialFoam(seeds, centers, initialization);
  state_.optimizer = std::make_unique<FoamOptimizer>(state_.foam);
  state_.densification.Reset(state_.foam.NumSites());
  start_cells_.assign(views_.NumViews(), 0);
  MakeCache();
  device_->Upload();
  Retriangulate();
}

// Where the views do not fit into memory.
void Trainer::MakeCache() {
  if (views_.HoldsPixels()) return;
  DrawingPlan plan;
  plan.seed = options_.random_seed;
  plan.num_tiles = NumTiles(options_.rays_per_iteration);
  plan.ranges.resize(2);
  plan.ranges[kAllButProbes] = pixels_;
  plan.ranges[kAllViews] = PixelRange(views_, views_to_train_on_);
  plan.first_iteration = progress_.iteration;
  plan.may_grow = options_.seconds > 0;
  plan.kept = ProbePixels();
  num_probes_kept_ = plan.kept.size();
  const std::vector<ViewPixel> held_out = EvaluationPixels(views_);
  plan.kept.insert(plan.kept.end(), held_out.begin(), held_out.end());
  if (probe_pixels_.size() > 0) {
    plan.ranges_at = [this](int64_t iteration) { return RangesAt(iteration); };
  } else {
    plan.ranges_at = [](int64_t) { return std::vector<int>{kAllViews}; };
  }
  cache_ = std::make_unique<PixelCache>(views_, std::move(plan));
}

std::vector<uint32_t> Trainer::StartCellsWith(const std::vector<int>& views) const {
  std::vector<Eigen::Vector3d> origins;
  std::vector<uint32_t> cells;
  for (const int view : views) {
    origins.push_back(views_.Origin(view));
    cells.push_back(start_cells_[view]);
  }
  device_->StartCells(origins, &cells);
  std::vector<uint32_t> result = start_cells_;
  for (size_t i = 0; i < views.size(); ++i) result[views[i]] = cells[i];
  return result;
}

void Trainer::DrawBatch() {
  start_cells_ = StartCellsWith(views_to_train_on_);
  const PixelValue* values = nullptr;
  if (cache_) {
    values = cache_->Drawn(progress_.iteration, RangeInCache(), schedule_.num_iterations());
  }
  summary_.nonfinite_pixels += DrawRays(views_,
                                        pixels_,
                                        values,
                                        start_cells_,
                                        options_.rays_per_iteration,
                                        options_.random_seed,
                                        progress_.iteration,
                                        &rays_);
}

void Trainer::Iterate() {
  DrawBatch();
  if (rays_.empty()) return;
  const RayLossWeights weights{1,
                               options_.opacity_weight,
                               options_.quantile_weight * std::min(2 * RunFraction(), 1.0),
                               options_.identity_weight,
                               options_.identity_to_density};
  const bool has_tv = state_.foam.HasSemantics() && options_.tv_weight > 0 &&
                      progress_.iteration % kTvInterval == 0;
  const TrainingStepResult result =
      device_->Step({rays_,
                     weights,
                     static_cast<float>(-std::log(options_.transmittance_cutoff)),
                     has_tv ? options_.tv_weight * kTvInterval : 0,
                     schedule_.Rates(progress_.iteration)});
  batch_ = result.batch;
  if (has_tv) {
    tv_sum_ += result.tv_loss;
    ++tv_count_;
  }
  guard_.Watch(progress_.iteration, rays_, batch_, result.tv_loss, result.skipped_updates);
  summary_.nonfinite_gradients += result.skipped_updates;
  summary_.step_limit_hits += batch_.step_limit_hits;
  summary_.segments += batch_.num_segments;
  loss_sum_.color += batch_.mean_loss.color;
  loss_sum_.opacity += batch_.mean_loss.opacity;
  loss_sum_.quantile += batch_.mean_loss.quantile;
  loss_sum_.identity += batch_.mean_loss.identity;
  ++loss_count_;
}

void Trainer::EvaluateIfDue() {
  if (RunFraction() * kNumEvaluations < evaluations_ + 1) return;
  ++evaluations_;
  const auto begin = std::chrono::steady_clock::now();
  std::function<const PixelValue*(size_t k)> value_of;
  if (cache_) value_of = [this](size_t k) { return &cache_->Kept(num_probes_kept_ + k); };
  std::vector<int> held_out;
  for (int view = 0; view < views_.NumViews(); ++view) {
    if (views_.IsHeldOut(view)) held_out.push_back(view);
  }
  const HeldOutQuality quality =
      EvaluateHeldOut(views_, value_of, StartCellsWith(held_out), state_.foam, device_.get());
  progress_.held_out_psnr = quality.psnr;
  progress_.held_out_miou = quality.miou;
  seconds_evaluating_ += SecondsSince(begin);
}

void Trainer::Report(const TrainingHooks& hooks) {
  progress_.num_iterations = schedule_.num_iterations();
  progress_.sites = state_.foam.NumSites();
  progress_.seconds = SecondsSince(begin_);
  const double done = RunFraction();
  const double learning = progress_.seconds - seconds_reading_;
  progress_.seconds_left = done > 0 ? learning * (1 - done) / done : NAN;
  if (loss_count_ > 0) {
    progress_.color_loss = loss_sum_.color / loss_count_;
    progress_.opacity_loss = loss_sum_.opacity / loss_count_;
    progress_.quantile_loss = loss_sum_.quantile / loss_count_;
    progress_.identity_loss = state_.foam.HasSemantics() ? loss_sum_.identity / loss_count_ : NAN;
    loss_sum_ = {};
    loss_count_ = 0;
  }
  if (tv_count_ > 0) {
    progress_.tv_loss = tv_sum_ / tv_count_;
    tv_sum_ = 0;
    tv_count_ = 0;
  }
  last_report_ = progress_.seconds;
  summary_.log.push_back(progress_);
  if (hooks.report) hooks.report(progress_);
}

TrainingSummary Trainer::Run(const TrainingHooks& hooks) {
  const TrainingHooks::Save save = [this](CheckpointContents* contents) { Save(contents); };
  if (cache_ && hooks.report) {
    cache_->SetReport([&](int done, int total) {
      TrainingProgress reading = progress_;
      reading.photos_read = done;
      reading.photos_to_read = total;
      reading.seconds = SecondsSince(begin_);
      hooks.report(reading);
    });
  }
  if (cache_) {
    // Not counted in what an iteration takes.
    const double begin = SecondsSince(begin_);
    cache_->Drawn(progress_.iteration, RangeInCache(), schedule_.num_iterations());
    seconds_reading_ = SecondsSince(begin_) - begin;
  }
  while (true) {
    Iterate();
    ++progress_.iteration;
    progress_.rays += rays_.size();
    ChooseShDegreeIfDue();
    UpdateTopology();
    schedule_.FitToSeconds(views_, progress_.iteration, SecondsSince(begin_), seconds_evaluating_);
    EvaluateIfDue();
    if (progress_.iteration >= schedule_.num_iterations()) break;
    if (SecondsSince(begin_) - last_report_ > 1) Report(hooks);
    if (hooks.between_iterations) hooks.between_iterations(progress_.iteration, save);
  }
  Report(hooks);
  if (progress_.rays == 0) {
    throw UserError(
        "There is nothing to train on: no pixel that was drawn has a ray and a finite colour.");
  }
  guard_.Finish(progress_.iteration);
  summary_.triangulation_lag = TriangulationLag(state_.foam.NumSites());
  summary_.late_rays = schedule_.late_rays();
  summary_.unstable_iterations = guard_.unstable_iterations();
  summary_.explained_contrast = guard_.explained_contrast();
  // One that is still under way is of no use any more.
  pending_.reset();
  device_->Download();
  device_.reset();
  summary_.foam = std::move(state_.foam);
  state_ = {};  // The renderer makes its own topology.
  summary_.statistics = MeasureCells(
      summary_.foam, ViewRenderer(summary_.foam, hooks.device), views_, StatisticsStride(views_));
  summary_.last = progress_;
  return std::move(summary_);
}

std::string TrainingSummary::BriefReport() const {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "Trained " << foam.NumSites() << " cells in "
       << last.seconds << " s with " << last.rays / 1e6 << " M rays ("
       << last.rays / std::max(last.seconds, 1e-9) / 1e3 << " k rays/s, "
       << double(segments) / std::max<int64_t>(last.rays, 1) << " cells a ray); " << triangulations
       << (triangulation_lag > 0 ? " triangulations beside the iterations held these up for "
                                 : " triangulations took ")
       << seconds_triangulating << " s; " << step_limit_hits << " rays hit the step limit, "
       << nonfinite_gradients << " updates skipped";
  if (std::isfinite(last.held_out_psnr)) {
    text << "; held-out PSNR " << std::setprecision(2) << last.held_out_psnr << " dB";
  }
  if (std::isfinite(last.held_out_miou)) {
    text << ", mIoU " << std::setprecision(3) << last.held_out_miou << " against the masks";
  }
  text << ".";
  return text.str();
}

TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          TrainingHooks hooks) {
  if (const std::string reason = options.Check(); !reason.empty()) throw UserError(reason);
  Trainer trainer(views, seeds, options, hooks);
  if (hooks.resume_from == nullptr) {
    trainer.Begin(seeds, num_classes);
  } else {
    trainer.Resume(num_classes, std::move(hooks.resume_from));
  }
  return trainer.Run(hooks);
}

TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          const std::function<void(const TrainingProgress&)>& report,
                          const Device& device) {
  TrainingHooks hooks;
  hooks.report = report;
  hooks.device = device;
  return TrainFoam(views, seeds, num_classes, options, std::move(hooks));
}

}  // namespace semfoam
