// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "foam/device/device.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/colmap_model.h"
#include "tools/commands/commands.h"
#include "tools/controllers/presets.h"
#include "tools/controllers/time_budget.h"
#include "tools/controllers/training_run.h"
#include "tools/evaluation/accuracy_study.h"
#include "tools/evaluation/evaluation.h"
#include "tools/evaluation/surface_error.h"
#include "tools/options/quality_plot.h"
#include "tools/options/training_run_options.h"
#include "tools/support/output_lock.h"
#include "tools/support/progress.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Of the budget, for the base and the sweeps around it, where the base is chosen to fit.
constexpr double kSweepShare = 0.6;
// Of the budget, at most, for measuring what trainings will take; and in seconds.
constexpr double kPilotShare = 0.02, kLongestPilot = 10;
// Of the budget, for one export.
constexpr double kExportShare = 0.1;
constexpr int kVoxelResolutions[] = {64, 128, 256, 512};

int LongestSide(const TrainingScene& scene) {
  int longest = 0;
  for (int view = 0; view < scene.NumViews(); ++view) {
    longest = std::max({longest, scene.Width(view), scene.Height(view)});
  }
  return longest;
}

class Study {
 public:
  Study(TrainingRun run, bool quality_is_given, fs::path output_path, double budget)
      : quality_is_given_(quality_is_given),
        run_(std::move(run)),
        output_path_(std::move(output_path)),
        budget_(budget),
        scene_(LoadScene(run_, run_.scene)),
        truth_(FindTruth("", run_.scene.image_path)),
        time_(scene_,
              scene_.Seeds(),
              scene_.NumClasses(),
              run_.device,
              std::min(kPilotShare * budget, kLongestPilot)) {
    depth_views_ = MakeDepthViews(ReadReconstruction(FindModelFolder(run_.scene.input_path)),
                                  scene_.Photos(),
                                  scene_.WorldFromNormalized());
    LOG(INFO) << scene_.PhotoReport();
    LOG(INFO) << scene_.MaskReport();
    LogWarnings(scene_);
    fits_exposure_ = BringToReferenceExposure(&scene_);
    AddSurfaceSeeds(run_, &scene_);
  }

  void Run() {
    const StudyRun base = ChooseBase();
    std::vector<StudyRun> runs;
    for (const EnumName<Quality>& quality : kQualityNames) {
      StudyRun run{"preset", quality.name, run_.training, run_.scene.max_image_size};
      TakeSchedule(OptionsForQuality(quality.value), run_.kept_options, &run.training);
      if (quality.name != base.value) runs.push_back(std::move(run));
    }
    for (StudyRun& run : SweepsAroundBase(base)) runs.push_back(std::move(run));
    Announce(base, &runs);

    const auto begin = std::chrono::steady_clock::now();
    TrainAndScore(base, /*with_exports=*/true);
    // What came of the first estimate corrects the others.
    const double slower = rows_.front().seconds / time_.TrainingSeconds(base.training);
    const double scoring = SecondsSince(begin) - seconds_exporting_ - rows_.front().seconds;
    for (const StudyRun& run : runs) {
      const double estimate = slower * time_.TrainingSeconds(run.training) + scoring;
      if (SecondsSince(begin_) + estimate > budget_) {
        LOG(INFO) << "Left out, as the budget ends: " << run.sweep << " " << run.value;
        continue;
      }
      TrainAndScore(run, /*with_exports=*/false);
    }
  }

 private:
  // Returns the preset of the user; if none was given and the default would not leave time for the
  // sweeps, shorter options interpolated between the presets (OptionsOnPresetLine).
  StudyRun ChooseBase() const {
    StudyRun base{
        "preset", NameOf(kQualityNames, run_.quality), run_.training, run_.scene.max_image_size};
    if (quality_is_given_) return base;
    const auto seconds = [&] {
      double sum = time_.TrainingSeconds(base.training);
      for (const StudyRun& run : SweepsAroundBase(base)) {
        sum += time_.TrainingSeconds(run.training);
      }
      return sum;
    };
    while (seconds() > kSweepShare * budget_ && base.training.num_rays > 50'000) {
      TrainingOptions smaller =
          OptionsOnPresetLine(static_cast<int64_t>(0.8 * base.training.num_rays));
      base.sweep = "base";
      base.value = FormatValue(smaller.num_rays);
      const int64_t before = base.training.num_rays;
      TakeSchedule(smaller, run_.kept_options, &base.training);
      if (base.training.num_rays == before) break;  // the user gave it
    }
    return base;
  }

  std::vector<StudyRun> SweepsAroundBase(const StudyRun& base) const {
    return SweepsAround(base.training, LongestSide(scene_), Sweeps(run_));
  }

  // Drops what the budget does not hold, the sweeps having precedence over the presets, and says
  // what will be done.
  void Announce(const StudyRun& base, std::vector<StudyRun>* runs) {
    const auto seconds = [&](const StudyRun& run) { return time_.TrainingSeconds(run.training); };
    double left = budget_ - SecondsSince(begin_) - seconds(base);
    std::vector<bool> fits(runs->size(), false);
    for (const bool presets : {false, true}) {
      for (size_t i = 0; i < runs->size(); ++i) {
        const StudyRun& run = (*runs)[i];
        if ((run.sweep == "preset") != presets || seconds(run) > left) continue;
        fits[i] = true;
        left -= seconds(run);
      }
    }
    LOG(INFO) << "Plan for " << FormatDuration(budget_) << ", trainings as estimated:";
    LOG(INFO) << "  " << base.sweep << " " << base.value << ": " << FormatDuration(seconds(base))
              << ", and its exports";
    std::vector<StudyRun> kept;
    for (size_t i = 0; i < runs->size(); ++i) {
      StudyRun& run = (*runs)[i];
      LOG(INFO) << "  " << run.sweep << " " << run.value << ": " << FormatDuration(seconds(run))
                << (fits[i] ? "" : ", left out");
      if (fits[i]) kept.push_back(std::move(run));
    }
    *runs = std::move(kept);
  }

  // Fits the photos' light as a training does. Returns whether exposure is on.
  bool BringToReferenceExposure(TrainingScene* scene) const {
    SceneEffects effects = ProbeEffects(*scene, run_.effects);
    scene->SetLights(std::move(effects.lights));
    return effects.Find("exposure").on;
  }

  // Loads the photos for one run: at its size, and without a plane sweep where it has none.
  TrainingScene SceneOf(const StudyRun& run) const {
    SceneOptions options = run_.scene;
    if (run.max_image_size > 0) options.max_image_size = run.max_image_size;
    TrainingScene scene = LoadScene(run_, options);
    BringToReferenceExposure(&scene);
    if (run.sweeps) AddSurfaceSeeds(run_, &scene);
    return scene;
  }

  // Trains, scores, adds the row and writes all that is known by then.
  void TrainAndScore(const StudyRun& run, bool with_exports) {
    std::optional<TrainingScene> own_scene;
    const bool is_reduced = run.max_image_size > 0 && run.max_image_size < LongestSide(scene_);
    if (is_reduced || !run.sweeps) own_scene.emplace(SceneOf(run));
    const TrainingScene& scene = own_scene ? *own_scene : scene_;
    const auto begin = std::chrono::steady_clock::now();
    TrainingSummary summary =
        TrainFoam(scene, scene.Seeds(), scene.NumClasses(), run.training, nullptr, run_.device);
    AccuracyRow row{run.sweep,
                    run.value,
                    summary.last.rays,
                    summary.last.sites,
                    run.training.sh_degree,
                    LongestSide(scene),
                    run.training.transmittance_cutoff};
    row.seconds = SecondsSince(begin);
    own_scene.reset();

    Model model;
    model.foam = std::move(summary.foam);
    model.statistics = std::move(summary.statistics);
    model.world_from_normalized = scene_.WorldFromNormalized();
    model.labels = scene_.Labels();
    model.photos = scene_.Photos();  // at full size, whatever was trained on
    row.miou = summary.last.held_out_miou;
    Score(model, kDefaultSupersample, &row);
    const ViewRenderer renderer(model.foam, run_.device);
    const double scale = model.world_from_normalized.scale;
    row.surface_error = scale * SurfaceError(depth_views_, [&](const DepthView& view) {
                          return FoamDistances(renderer, view);
                        });
    Add(row);
    if (with_exports) {
      AccuracyRow one_ray = row;
      one_ray.sweep = "supersample";
      one_ray.value = "1";
      Score(model, 1, &one_ray);
      Add(one_ray);
      const auto begin_exports = std::chrono::steady_clock::now();
      Export(row, model, renderer);
      seconds_exporting_ = SecondsSince(begin_exports);
    }
  }

  // Scores the pictures and, where there are exact masks, the labels of `model`.
  void Score(const Model& model, int supersample, AccuracyRow* row) const {
    const Scores scores =
        ScoreModel(model,
                   "the study's foam",
                   {run_.scene.image_path, truth_, fits_exposure_, supersample, run_.device});
    if (rows_.empty()) {
      for (const std::string& sentence : scores.unscored) LOG(WARNING) << sentence;
    }
    row->psnr = MeanOf(scores.views).psnr;
    row->ssim = MeanOf(scores.views).ssim;
    const std::optional<LabelScore> exact = MeanOf(scores.objects, /*direct=*/true);
    if (exact.has_value()) row->miou = exact->iou;
  }

  // What exports of one foam keep of its surfaces, over the points in the box of its volume.
  void Export(const AccuracyRow& trained, const Model& model, const ViewRenderer& renderer) {
    const ScratchFolder scratch(output_path_);
    const double scale = model.world_from_normalized.scale;
    AccuracyRow row = trained;
    row.psnr = row.ssim = row.miou = NAN;

    const auto begin = std::chrono::steady_clock::now();
    const ExportableScene scene = MakeExportableScene(model);
    const double preparing = SecondsSince(begin);
    VolumeExportOptions volume;
    const std::vector<DepthView> views = Within(depth_views_, MakeVolumeFrame(scene, volume).box);

    row.sweep = "surface";
    row.value = "foam";
    row.surface_error = scale * SurfaceError(views, [&](const DepthView& view) {
                          return FoamDistances(renderer, view);
                        });
    Add(row);
    if (!scene.objects.empty()) {
      const auto begin_meshes = std::chrono::steady_clock::now();
      SurfaceExportOptions cells;
      cells.method = SurfaceMethod::kCells;
      ExportSurfaces(scene, scratch.path(), cells);
      row.value = "cells";
      row.seconds = trained.seconds + preparing + SecondsSince(begin_meshes);
      row.surface_error = scale * SurfaceError(views, [&](const DepthView& view) {
                            return CellSurfaceDistances(renderer, scene, view);
                          });
      Add(row);
    }
    row.sweep = "VolumeExport.max_resolution";
    double last = 0;
    for (const int resolution : kVoxelResolutions) {
      // Twice the resolution takes some five times as long.
      if (5 * last > kExportShare * budget_) break;
      const auto begin_volumes = std::chrono::steady_clock::now();
      volume.max_resolution = resolution;
      ExportVolumes(scene, scratch.path(), volume);
      row.value = std::to_string(resolution);
      last = SecondsSince(begin_volumes);
      row.seconds = trained.seconds + preparing + last;
      const VolumeFrame frame = MakeVolumeFrame(scene, volume);
      row.surface_error = scale * SurfaceError(views, [&](const DepthView& view) {
                            return VolumeDistances(scene, frame, volume.min_optical_depth, view);
                          });
      Add(row);
    }
  }

  // One more row, on the screen and in all files: what is interrupted keeps what it has.
  void Add(const AccuracyRow& row) {
    rows_.push_back(row);
    std::string line = FormatAccuracyCsv({row});
    line = line.substr(line.find('\n') + 1);
    line.pop_back();
    LOG(INFO) << FormatDuration(SecondsSince(begin_)) << "  " << line;
    WriteTextFile(output_path_ / "accuracy.csv", FormatAccuracyCsv(rows_));
    WriteTextFile(output_path_ / "accuracy.md", Report());
    WritePlot(output_path_ / "accuracy", AccuracyPlot(rows_));
  }

  std::string Report() const {
    return "# What accuracy costs\n\n" + scene_.PhotoReport() + "; " + scene_.MaskReport() + ". " +
           run_.device.Description() +
           ".\n\n"
           "Seconds of training (loading apart), for exports with the export. PSNR and SSIM of the "
           "held-out photos at full size. mIoU: " +
           (truth_.empty() ? "against the masks of the held-out photos"
                           : "of the labels against the exact masks in segmentation_labels/") +
           ". Surface error: the median distance, in units of the COLMAP model, between what a "
           "held-out camera meets and the SfM points that it saw; in the rows of exports, over the "
           "points in the volume's box. Bold: nothing quicker is better (the Pareto front).\n\n" +
           FormatAccuracyTable(rows_) + "\n![](accuracy.svg)\n";
  }

  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  const bool quality_is_given_;
  const TrainingRun run_;
  const fs::path output_path_;
  const double budget_;
  TrainingScene scene_;
  bool fits_exposure_ = false;
  const fs::path truth_;
  const TrainingTimeModel time_;
  std::vector<DepthView> depth_views_;
  std::vector<AccuracyRow> rows_;
  double seconds_exporting_ = 0;
};

// Options of the command line.
struct ProfilerOptions {
  std::string workspace_path;
  std::string output_path;
  std::string run_paths;
  std::string names;
  double budget = 1800;  // seconds
  TrainingRunOptions training;
};

void AddOptions(OptionManager* options, ProfilerOptions* profiler) {
  options->AddDefaultOption("workspace_path",
                            &profiler->workspace_path,
                            "(or --run_paths) folder with images/, sparse/ and object_mask/");
  options->AddRequiredOption(
      "output_path", &profiler->output_path, "folder for accuracy.csv, .md, .svg and .png");
  options->AddDefaultOption("run_paths",
                            &profiler->run_paths,
                            "instead of a study: draw the held-out quality of these trainings over "
                            "their seconds, as quality_over_seconds.svg and .png; their folders, "
                            "with commas between: a,b,c");
  options->AddDefaultOption(
      "names",
      &profiler->names,
      "with --run_paths: what to call them, with commas between; empty = by their folders");
  options->AddDefaultOption("budget",
                            &profiler->budget,
                            "seconds for the study; without --quality they also size its base");
  AddTrainingRunOptions(options, &profiler->training);
  options->SetFrequentOptions(
      {"workspace_path", "budget", "quality", "test_every", "mask_path", "run_paths", "names"});
}

// Throws UserError where the options of a study are out of range.
void RequireStudy(const ProfilerOptions& profiler) {
  if (!(profiler.budget > 0)) {
    throw UserError("Failed to parse options - --budget is ",
                    profiler.budget,
                    "; it must be a number of seconds greater than 0.");
  }
  if (profiler.training.run.time_budget > 0) {
    throw UserError(
        "Failed to parse options - --FoamTraining.time_budget is for one training; --budget sizes "
        "a study.");
  }
  if (profiler.training.run.scene.test_every == 0) {
    throw UserError(
        "Failed to parse options - --test_every 0 holds out no photo to measure quality on; 8 "
        "would be right.");
  }
}

}  // namespace

void RunAccuracyProfiler(int argc, char** argv) {
  ProfilerOptions profiler;
  profiler.training.run.scene.test_every = 8;
  OptionManager options("accuracy_profiler",
                        "Trains a COLMAP workspace many times, with one option changed at a time, "
                        "and shows what quality costs in seconds; or draws the quality of "
                        "trainings that there are.");
  AddOptions(&options, &profiler);
  if (!options.Parse(argc, argv)) return;
  if (profiler.workspace_path.empty() == profiler.run_paths.empty()) {
    throw UserError(
        "Failed to parse options - either --workspace_path, to make a study, or --run_paths, to "
        "draw trainings that there are, would be right.");
  }
  if (!profiler.run_paths.empty()) {
    PlotTrainings(profiler.run_paths, profiler.names, profiler.output_path);
    return;
  }
  RequireStudy(profiler);
  FinishTrainingRun(options, profiler.workspace_path, &profiler.training);
  const OutputLock lock(profiler.output_path);
  Study study(
      profiler.training.run, options.IsGiven("quality"), profiler.output_path, profiler.budget);
  study.Run();
  LOG(INFO) << "accuracy.csv, .md, .svg and .png are in " << profiler.output_path;
}

}  // namespace semfoam
