// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/trainer.h"

#include "foam/device/device_factory.h"
#include "foam/optim/initialization.h"
#include "foam/train/hanging_cells.h"
#include "foam/train/label_spreading.h"
#include "foam/train/trainer_internal.h"
#include "foam/train/training_rays.h"
#include "foam/util/checksummed_file.h"
#include "foam/util/error.h"
#include "foam/util/rank_group.h"
#include "foam/view/cell_statistics.h"
#include "foam/view/view_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <iterator>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

namespace semfoam {
namespace {

// The variations touch every cell, the rays only some: each takes one step in so many, with so many
// times the weight; that of the colours half-way between those of the identities.
constexpr int64_t kTvInterval = 8;

// Ranks compare their foams once in so many iterations, which costs less than a thousandth of them.
constexpr int64_t kFoamComparison = 256;

InitializationOptions InitializationOf(const TrainingOptions& options, int num_classes) {
  InitializationOptions initialization;
  initialization.max_seed_sites = std::min(options.initial_sites, options.final_sites);
  initialization.max_point_sites = PointSites(options);
  initialization.num_scattered = ScatteredSites(options);
  initialization.num_far = FarSites(options);
  initialization.sh_degree = 0;  // raised later
  initialization.num_classes = num_classes;
  initialization.seed = options.random_seed;
  return initialization;
}

}  // namespace

Trainer::Trainer(const TrainingViews& views,
                 const std::vector<SeedPoint>& seeds,
                 const TrainingOptions& options,
                 const TrainingHooks& hooks)
    : views_(views),
      options_(options),
      schedule_(options),
      pixels_(views, options),
      device_(hooks.make_device ? hooks.make_device(&state_)
                                : MakeTrainingDevice(hooks.device, &state_)),
      ranks_(device_->ranks()),
      camera_cells_(views, device_.get()),
      topology_(views, seeds, options, schedule_, &camera_cells_, &state_, device_.get()),
      sh_degree_(options, schedule_, camera_cells_, &pixels_, &state_, device_.get()),
      evaluator_(views, schedule_, pixels_, camera_cells_, state_, device_.get()) {
  if (pixels_.IsEmpty()) {
    throw UserError(
        "There is no photo to train on: all are held out or missing; hold out fewer "
        "(test_every).");
  }
}

void Trainer::Begin(const std::vector<SeedPoint>& seeds, int num_classes) {
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(views_.NumViews());
  for (int view = 0; view < views_.NumViews(); ++view) centers.push_back(views_.Origin(view));
  state_.foam = InitialFoam(seeds, centers, InitializationOf(options_, num_classes));
  if (options_.HasColorGradients()) {
    state_.foam.color_gradient.assign(state_.foam.NumSites() * kColorGradientDim, 0.f);
  }
  state_.optimizer = std::make_unique<FoamOptimizer>(state_.foam);
  state_.ResetDensification();
  OpenPixelCache();
  device_->Upload();
  topology_.Triangulate(log_.iteration());
}

void Trainer::OpenPixelCache() {
  pixels_.OpenCache(log_.iteration(),
                    [this](int64_t iteration) { return sh_degree_.ProbeUseAt(iteration); });
}

TrainingSummary Trainer::Run(const TrainingHooks& hooks) {
  const TrainingHooks::Save save = [this](CheckpointContents* contents) { Save(contents); };
  ReadPixels(hooks);
  while (IterateAndUpdate(hooks, save)) {
    if (log_.ReportIsDue()) log_.Report(schedule_, state_.foam, hooks.report);
    if (hooks.between_iterations) hooks.between_iterations(log_.iteration(), save);
  }
  log_.Report(schedule_, state_.foam, hooks.report);
  return Finish(hooks);
}

bool Trainer::IterateAndUpdate(const TrainingHooks& hooks, const TrainingHooks::Save& save) try {
  Iterate();
  log_.EndIteration(rays_.size());
  sh_degree_.Update(log_.iteration());
  topology_.Update(log_.iteration());
  FitToSecondsIfDue();
  // A block is a part of what the held-out views show.
  const auto quality = TrainsBlock() ? std::nullopt : evaluator_.EvaluateIfDue(log_.iteration());
  if (quality) log_.SetQuality(*quality);
  const bool is_last = log_.iteration() >= schedule_.num_iterations();
  if (hooks.preview) hooks.preview(log_.iteration(), is_last, PixelRenderer());
  if (is_last) return false;
  AdaptViewsIfDue(hooks);
  ClearHangingCellsIfDue();
  RequireOneFoam();
  return true;
} catch (const LostRank&) {
  if (hooks.between_iterations) hooks.between_iterations(log_.iteration(), save);
  throw;
}

void Trainer::FitToSecondsIfDue() {
  if (!schedule_.NeedsSeconds(log_.iteration())) return;
  struct Seconds {
    double all, evaluating;
  };
  Seconds seconds{log_.Seconds(), evaluator_.seconds()};
  try {
    seconds = FromFirstRank(ranks_, seconds);
  } catch (const LostRank&) {
    // What is due after this iteration is done first, as it is not done again after a resume; the
    // next exchange throws again. Rank 0, which saves the state, has its own seconds anyway.
  }
  schedule_.FitToSeconds(views_, log_.iteration(), seconds.all, seconds.evaluating);
}

// Ranks exchange gradients, and not what each makes of them.
void Trainer::RequireOneFoam() {
  if (ranks_ == nullptr || log_.iteration() % kFoamComparison != 1) return;
  device_->Download();
  const Foam& foam = state_.foam;
  const auto bytes = [](const auto& values) { return std::as_bytes(std::span(values)); };
  RequireAgreement(ranks_,
                   ChecksumText({bytes(foam.positions),
                                 bytes(foam.raw_density),
                                 bytes(foam.sh),
                                 bytes(foam.color_gradient),
                                 bytes(foam.identity),
                                 bytes(foam.classifier_weight),
                                 bytes(foam.classifier_bias)}),
                   "numbers in the same foam",
                   "the same build on processors of one kind");
}

void Trainer::ReadPixels(const TrainingHooks& hooks) {
  PixelCache::Report report;
  if (hooks.report) {
    report = [&](int done, int total) { log_.ReportReading(done, total, hooks.report); };
  }
  const double begin = log_.Seconds();
  pixels_.Read(log_.iteration(), schedule_.num_iterations(), std::move(report));
  log_.SetSecondsReading(log_.Seconds() - begin);
}

void Trainer::Iterate() {
  const int64_t iteration = log_.iteration();
  const std::vector<uint32_t>& start_cells = camera_cells_.Update(pixels_.training_views());
  const int64_t nonfinite_pixels =
      pixels_.Draw(iteration, schedule_.num_iterations(), start_cells, &rays_);
  if (rays_.empty()) {
    summary_.nonfinite_pixels += nonfinite_pixels;
    return;
  }
  // The loss is a mean over the rays drawn; a cell gets the gradient that it gets where rays are
  // drawn from whole photos.
  const double share =
      TrainsBlock() ? double(rays_.size()) / (kTileRays * NumTiles(options_.rays_per_iteration))
                    : 1;
  // Terms on where and how surfaces are come in as these form.
  const double settled = std::min(2 * schedule_.RunFraction(iteration), 1.0);
  const RayLossWeights weights{share,
                               share * options_.opacity_weight,
                               share * options_.quantile_weight * settled,
                               share * options_.identity_weight,
                               options_.identity_to_density,
                               share * options_.distance_weight};
  const bool has_tv =
      state_.foam.HasSemantics() && options_.tv_weight > 0 && iteration % kTvInterval == 0;
  const bool has_color_tv = iteration % kTvInterval == kTvInterval / 2;
  const TrainingStepResult result =
      device_->Step({rays_,
                     weights,
                     static_cast<float>(-std::log(options_.transmittance_cutoff)),
                     has_tv ? options_.tv_weight * kTvInterval : 0,
                     has_color_tv ? settled * options_.color_tv_weight * kTvInterval : 0,
                     schedule_.Rates(iteration)});
  // Not before the step, which may throw LostRank.
  summary_.nonfinite_pixels += nonfinite_pixels;
  guard_.Watch(iteration, rays_, result.batch, result.tv_loss, result.skipped_updates);
  topology_.Observe(result.batch);
  log_.AddLoss(result.batch.mean_loss);
  if (has_tv) log_.AddTvLoss(result.tv_loss);
  summary_.nonfinite_gradients += result.skipped_updates;
  summary_.step_limit_hits += result.batch.step_limit_hits;
}

TrainingHooks::RenderPixels Trainer::PixelRenderer() {
  return [this](const std::vector<ViewPixel>& pixels) {
    std::vector<int> rendered_views;
    for (const ViewPixel& pixel : pixels) rendered_views.push_back(pixel.view);
    std::sort(rendered_views.begin(), rendered_views.end());
    rendered_views.erase(std::unique(rendered_views.begin(), rendered_views.end()),
                         rendered_views.end());
    const std::vector<uint32_t> start_cells = camera_cells_.Find(rendered_views);
    std::vector<BatchRay> rays;
    std::vector<size_t> indices;
    for (size_t i = 0; i < pixels.size(); ++i) {
      const ViewPixel& pixel = pixels[i];
      BatchRay ray;
      if (!views_.RayDirection(pixel.view, pixel.x, pixel.y, &ray.direction)) continue;
      ray.origin = views_.Origin(pixel.view).cast<float>();
      ray.start_cell = start_cells[pixel.view];
      rays.push_back(ray);
      indices.push_back(i);
    }
    std::vector<RenderedRay> result(pixels.size());
    const std::vector<RenderedRay> rendered = device_->Render(rays, state_.foam.sh_degree);
    for (size_t k = 0; k < rendered.size(); ++k) result[indices[k]] = rendered[k];
    return result;
  };
}

void Trainer::AdaptViewsIfDue(const TrainingHooks& hooks) {
  if (!hooks.adapt_views || num_adaptations_ == std::ssize(kViewAdaptations)) return;
  const double due = hooks.adapted_part * kViewAdaptations[num_adaptations_];
  if (schedule_.RunFraction(log_.iteration()) < due) return;
  ++num_adaptations_;
  hooks.adapt_views(PixelRenderer());
}

// What a block's photos show of other blocks is not its own to judge.
void Trainer::ClearHangingCellsIfDue() {
  if (TrainsBlock() || num_hanging_cell_searches_ == std::ssize(kHangingCellSearches)) return;
  const double due = kHangingCellSearches[num_hanging_cell_searches_];
  if (schedule_.RunFraction(log_.iteration()) < due) return;
  ++num_hanging_cell_searches_;
  device_->Download();
  const std::vector<uint32_t> hanging = FindHangingCells(state_.foam, state_.topology, views_);
  if (hanging.empty()) return;
  for (const uint32_t cell : hanging) state_.foam.raw_density[cell] = kTransparentRawDensity;
  summary_.hanging_cells += std::ssize(hanging);
  device_->Upload();
}

TrainingSummary Trainer::Finish(const TrainingHooks& hooks) {
  if (log_.rays() == 0) {
    throw UserError(
        "There is nothing to train on: no pixel that was drawn has a ray and a finite colour.");
  }
  guard_.Finish(log_.iteration());
  topology_.Summarize(&summary_);
  topology_.Abandon();
  summary_.late_rays = schedule_.late_rays();
  summary_.unstable_iterations = guard_.unstable_iterations();
  summary_.explained_contrast = guard_.explained_contrast();
  summary_.last = log_.progress();
  summary_.log = log_.reports();
  device_->Download();
  device_.reset();
  summary_.foam = std::move(state_.foam);
  state_ = {};  // The renderer makes its own topology.
  const ViewRenderer renderer(summary_.foam, hooks.device);
  const bool spreads_labels =
      summary_.foam.HasSemantics() && !TrainsBlock() && FewViewsHaveLabels(views_);
  const int stride = StatisticsStride(views_, options_.num_rays);
  CellMeasurements measured =
      MeasureCells(summary_.foam, renderer, views_, stride, hooks.measured_rays);
  if (spreads_labels) {
    summary_.spreading = SpreadLabels(
        renderer.delaunay(),
        measured.statistics,
        MeasureLabels(summary_.foam, renderer, views_, LabelStride(views_, options_.num_rays)),
        &summary_.foam);
  }
  // Last, because a renderer may cast rays only while its foam keeps its colours.
  summary_.hidden_cells = CompleteHiddenCells(renderer.delaunay(), &measured, &summary_.foam);
  summary_.statistics = std::move(measured.statistics);
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

std::vector<SeedPoint> StartingSeeds(std::vector<SeedPoint> seeds, const TrainingOptions& options) {
  return ThinDenseSeeds(std::move(seeds), InitializationOf(options, /*num_classes=*/0));
}

TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          TrainingHooks hooks) {
  if (const std::string reason = options.Check(); !reason.empty()) throw UserError(reason);
  const std::vector<SeedPoint> starting_seeds = StartingSeeds(seeds, options);
  Trainer trainer(views, starting_seeds, options, hooks);
  if (hooks.resume_from == nullptr) {
    trainer.Begin(starting_seeds, num_classes);
  } else {
    if (hooks.restore_views) hooks.restore_views();
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
