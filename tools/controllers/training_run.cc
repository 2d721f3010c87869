// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/training_run.h"

#include "foam/device/cpu_device.h"
#include "foam/edit/label_editing.h"
#include "foam/train/block_checkpoint.h"
#include "foam/train/checkpoint_state.h"
#include "foam/train/memory_plan.h"
#include "foam/util/available_memory.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "foam/util/output_file.h"
#include "foam/util/photo_name.h"
#include "foam/util/rank_group.h"
#include "plugin/dataset/scene_checksums.h"
#include "plugin/dataset/scene_memory.h"
#include "plugin/photometric/pose_refinement.h"
#include "plugin/photometric/view_adaptation.h"
#include "plugin/stereo/surface_seeds.h"
#include "plugin/stereo/surface_seeds_file.h"
#include "plugin/util/plural.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/mask_labels.h"
#include "tools/controllers/rank_decisions.h"
#include "tools/controllers/scene_loading.h"
#include "tools/controllers/time_budget.h"
#include "tools/controllers/training_log.h"
#include "tools/controllers/training_previews.h"
#include "tools/support/memory_task.h"
#include "tools/support/progress.h"
#include "tools/support/value_text.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// A foam that shows less of the photos' contrast than this has hardly learned them.
constexpr double kLeastExplainedContrast = 0.5;

std::filesystem::path PreviewFolder(const TrainingFolder& folder) {
  return folder.path() / "previews";
}

std::string Seconds(double seconds) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f s", seconds);
  return text;
}

std::string Millions(int64_t count) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g M", static_cast<double>(count) / 1e6);
  return text;
}

const char* TextOf(EffectSwitch value) {
  return value == EffectSwitch::kOn ? "on" : value == EffectSwitch::kOff ? "off" : "auto";
}

const char* TextOf(LabelZero value) {
  return value == LabelZero::kClass ? "class" : value == LabelZero::kIgnore ? "ignore" : "auto";
}

// Collects options by name, as text that reads back as the same value.
struct OptionTexts {
  std::map<std::string, std::string> values;
  template <typename T>
  void Number(const char* name, const T* value) {
    values[name] = FormatValue(*value);
  }
};

// Returns the options with which the run trains.
TrainingOptions TrainedOptions(const TrainingRun& run) {
  if (run.coarse_sites == 0) return run.training;
  return OptionsOfCoarse(run.training, run.coarse_sites, run.coarse_share);
}

// Returns the options of a training by name.
std::map<std::string, std::string> TrainingTexts(const TrainingRun& run) {
  OptionTexts texts;
  TrainingOptions training = run.training;
  training.Serialize(&texts);
  // These stand elsewhere, or shape nothing.
  for (const char* name : {"fixed_sh_degree", "random_seed", "seconds", "sh_degree_interval"})
    texts.values.erase(name);
  texts.values["max_image_size"] = FormatValue(run.scene.max_image_size);
  texts.values["sweep_photos"] = FormatValue(run.sweep_photos);
  texts.values["label_zero"] = TextOf(run.scene.label_zero);
  return texts.values;
}

std::map<std::string, std::string> ModelOptions(const TrainingRun& run,
                                                const SceneEffects& effects) {
  std::map<std::string, std::string> values = TrainingTexts(run);
  values["mask_consistency"] = NameOf(kMaskConsistencyNames, run.scene.mask_consistency);
  values["sh_degree"] = FormatValue(effects.sh_degree);
  for (const char* name : {"exposure", "poses", "shading", "vignetting"}) {
    if (effects.Find(name).on) values[name] = FormatValue(true);
  }
  values["quality"] = NameOf(kQualityNames, run.quality);
  values["random_seed"] = FormatValue(run.training.random_seed);
  values["test_every"] = FormatValue(run.scene.test_every);
  return values;
}

// Fits the run to its budget, of which `begin` was the beginning. Measures for less than a tenth of
// it; the rest of the fitting happens on the way (TrainingOptions::seconds).
void FitToBudget(const TrainingScene& scene,
                 std::chrono::steady_clock::time_point begin,
                 TrainingRun* run) {
  constexpr double kPilotShare = 0.07;
  const double before = SecondsSince(begin);
  const TrainingTimeModel model(scene,
                                scene.Seeds(),
                                scene.NumClasses(),
                                run->device,
                                kPilotShare * run->time_budget,
                                run->ranks);
  const double left =
      FromFirstRank(run->ranks, run->time_budget - SecondsSince(begin) - model.SeedingSeconds());
  TakeSchedule(OptionsOnPresetLine(model.RaysOnPresetLine(std::max(left, 0.1))),
               run->kept_options,
               &run->training);
  run->training.seconds =
      std::max(left - model.ClosingSeconds(run->training), 0.05 * run->time_budget);
  LOG(INFO) << "Time budget of " << run->time_budget << " s: " << Seconds(before)
            << " went into loading and probing, " << Seconds(SecondsSince(begin) - before)
            << " into measuring this machine; " << Seconds(run->training.seconds)
            << " of training follow";
}

// Completes the effect by what the sweep found infinitely far.
void DescribeSky(const SurfaceSeeds& found, Effect* effect) {
  effect->on = found.far_share > 0;
  effect->measures = {{"photos", found.num_far}, {"share", found.far_share}};
  char text[80];
  std::snprintf(text,
                sizeof(text),
                "%.1f %% of the pixels of %s are infinitely far",
                100 * found.far_share,
                Plural(found.num_swept, "photo").c_str());
  effect->evidence = effect->on ? text : "photos agree on nothing that is infinitely far";
}

// Returns the options and the checksums of the inputs that determine the result, by which a
// checkpoint is recognised.
CheckpointTexts IdentityOf(const TrainingRun& run,
                           const ScenePlan& plan,
                           const FileChecksums& files) {
  CheckpointTexts identity;
  auto& values = identity["options"];
  for (const auto& [name, value] : TrainingTexts(run)) values["FoamTraining." + name] = value;
  values["FoamTraining.time_budget"] = FormatValue(run.time_budget);
  values["Effects.exposure"] = TextOf(run.effects.exposure);
  values["Effects.white_balance"] = TextOf(run.effects.white_balance);
  values["Effects.shading"] = TextOf(run.effects.shading);
  values["Effects.poses"] = TextOf(run.effects.poses);
  values["Effects.blur"] = run.effects.blur ? "auto" : "off";
  values["Effects.transients"] = run.effects.transients ? "auto" : "off";
  values["Effects.sky"] = run.effects.sky ? "auto" : "off";
  values["Effects.vignetting"] = TextOf(run.effects.vignetting);
  values["Effects.distortion"] = TextOf(run.effects.distortion);
  values["Effects.semantics"] = run.effects.semantics ? "auto" : "off";
  values["Effects.sh_degree"] = run.effects.fixed_sh_degree ? "on" : "auto";
  values["Masks.consistency"] = NameOf(kMaskConsistencyNames, run.scene.mask_consistency);
  if (!run.scene.ignore_path.empty()) values["invert"] = FormatValue(run.scene.ignore_inverted);
  values["quality"] = NameOf(kQualityNames, run.quality);
  values["random_seed"] = FormatValue(run.training.random_seed);
  values["test_every"] = FormatValue(run.scene.test_every);
  for (const auto& [name, value] : run.more_identity) values[name] = value;
  const SceneChecksums checksums = ChecksumsOf(plan, files);
  identity["inputs"] = {{"masks", checksums.masks},
                        {"model", checksums.model},
                        {"photos", checksums.photos},
                        {"seed_cloud", checksums.seed_cloud}};
  return identity;
}

// Returns the names of the labels by id. They are stored in checkpoints for information only.
std::map<std::string, std::string> LabelTexts(const std::vector<Label>& labels) {
  std::map<std::string, std::string> texts;
  for (const Label& label : labels) texts[std::to_string(Value(label.id))] = label.name;
  return texts;
}

// Returns a line about the dense cloud, of which `seeds` are to be trained from; empty without one.
std::string CloudReport(const TrainingRun& run,
                        const TrainingScene& scene,
                        const std::vector<SeedPoint>& seeds) {
  if (run.scene.seed_path.empty()) return "";
  const SeedCloud& cloud = scene.Cloud();
  std::ostringstream text;
  text << cloud.num_points - cloud.num_not_finite - cloud.num_far << " of " << cloud.num_points
       << " points of " << run.scene.seed_path.string() << ", thinned to "
       << seeds.size() - scene.Plan().seeds.size();
  if (cloud.num_far > 0) text << "; " << cloud.num_far << " lie far from what the photos show";
  if (cloud.num_not_finite > 0) text << "; " << cloud.num_not_finite << " are not finite";
  if (!cloud.has_colors) text << "; without colours, so they begin grey";
  return text.str();
}

// Returns whether a checkpoint is of a run that trains one block, whose options are its own.
bool IsOfBlock(const Checkpoint* checkpoint) {
  return checkpoint != nullptr && !checkpoint->Texts("block").empty();
}

// Trains, with checkpoints. After a signal, or where TrainingRun::when_reported stops it, writes a
// last checkpoint and throws Interruption.
TrainingSummary Train(const TrainingScene& scene,
                      const std::vector<SeedPoint>& seeds,
                      const TrainingRun& run,
                      const CheckpointTexts& texts,
                      std::unique_ptr<Checkpoint> checkpoint,
                      ViewAdaptation* adaptation,
                      TrainingFolder* folder) {
  const MemoryTask task("the foam is trained",
                        "a smaller final_sites, rays_per_iteration or image_cache_gb");
  ProgressLine line;
  TrainingHooks hooks;
  CheckpointTexts all_texts = texts;
  if (IsOfBlock(checkpoint.get())) all_texts["block"] = checkpoint->Texts("block");
  hooks.device = run.device;
  if (run.ranks != nullptr) {
    hooks.make_device = [&run](TrainingState* state) {
      return MakeCpuTrainingDevice(state, run.ranks);
    };
  }
  std::optional<TrainingPreviews> previews;
  if (IsFirstRank(run.ranks) && folder->preview_every() > 0) {
    previews.emplace(scene, PreviewFolder(*folder), folder->preview_every(), checkpoint != nullptr);
    hooks.preview = [&previews](auto... arguments) { previews->Update(arguments...); };
  }
  bool goes_on = true;
  hooks.report = [&](const TrainingProgress& progress) {
    if (progress.photos_to_read > 0) {
      line.Show(CountProgress(
          "reading photos", progress.photos_read, progress.photos_to_read, progress.seconds));
    } else {
      line.Update(progress);
    }
    if (previews) previews->Report(progress);
    if (run.when_reported && !run.when_reported(progress)) goes_on = false;
  };
  hooks.measured_rays = run.measured_rays;
  hooks.adapted_part = run.adapted_part;
  // The blocks of a scene have one light, that of the run which they are of.
  if (!IsOfBlock(checkpoint.get())) {
    hooks.adapt_views = [&](const TrainingHooks::RenderPixels& render) {
      for (const std::string& line : adaptation->Adapt(render)) LOG(INFO) << line;
    };
  }
  const auto save_all = [&](const TrainingHooks::Save& save, CheckpointContents* contents) {
    contents->texts.insert(all_texts.begin(), all_texts.end());
    folder->AddIdentity(contents);
    StateWriter adapted("adaptation", contents);
    adaptation->Serialize(&adapted);
    save(contents);
  };
  const auto write = [&](int64_t iteration, const TrainingHooks::Save& save) {
    if (!IsFirstRank(run.ranks)) return;
    CheckpointContents contents;
    save_all(save, &contents);
    folder->Write(iteration, std::move(contents));
  };
  const auto write_last = [&](int64_t iteration, const TrainingHooks::Save& save) {
    write(iteration, save);
    if (IsFirstRank(run.ranks)) folder->LogHowToResume(iteration);
  };
  hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
    if (run.between_iterations) {
      run.between_iterations(iteration,
                             [&](CheckpointContents* contents) { save_all(save, contents); });
    }
    AfterIteration next{goes_on ? InterruptionRequested() : SIGINT, folder->IsDue()};
    try {
      next = DecideAfterIteration(run.ranks, next);
    } catch (const LostRank&) {
      write_last(iteration, save);
      throw;
    }
    if (next.signal != 0) {
      write_last(iteration, save);
      throw Interruption(next.signal);
    }
    if (next.checkpoint_is_due) write(iteration, save);
  };
  TrainingOptions training = TrainedOptions(run);
  if (IsOfBlock(checkpoint.get())) ReadOptions(*checkpoint, &training);
  if (checkpoint != nullptr) {
    StateReader adapted("adaptation", *checkpoint);
    adaptation->Serialize(&adapted);
    hooks.restore_views = [adaptation] { adaptation->Restore(); };
  }
  hooks.resume_from = std::move(checkpoint);
  if (IsFirstRank(run.ranks)) folder->Begin();
  return TrainFoam(scene, seeds, scene.NumClasses(), training, std::move(hooks));
}

// Returns the number of photos that are swept with a time budget: a photo takes about 0.4 s of one
// core, so this is at most a fifth of the budget.
int SweptPhotosWithin(double time_budget) {
  return static_cast<int>(std::min(time_budget, 1e6) / 2);
}

int64_t NumDrawn(const ScenePlan& plan) {
  int64_t num_drawn = 0;
  for (size_t i = 0; i < plan.photos.size(); ++i) num_drawn += plan.IsDrawn(i) ? 1 : 0;
  return num_drawn;
}

SweepMemory MemoryOfSweep(const TrainingRun& run, const ScenePlan& plan) {
  if (!Sweeps(run)) return {};
  const int64_t num_photos = std::min<int64_t>(NumDrawn(plan), run.sweep_photos);
  if (!run.known_sweep.empty()) return {0, static_cast<int64_t>(PhotoDepthBytes(num_photos))};
  return {static_cast<int64_t>(SurfaceSeedBytes(num_photos)),
          static_cast<int64_t>(PhotoDepthBytes(num_photos))};
}

// Plans the scene and logs its warnings. Throws UserError for what could only fail after the
// training: what `when_planned` refuses, and names of photos that scene.foam cannot hold.
ScenePlan PlanRun(const TrainingRun& run) {
  ScenePlan plan = PlanScene(run.scene);
  for (const std::string& warning : plan.warnings) LOG(WARNING) << warning;
  if (run.when_planned) run.when_planned(plan);
  for (const PhotoRecord& photo : plan.photos) {
    if (IsUtf8(photo.name)) continue;
    throw UserError((run.scene.image_path / photo.name).string(),
                    ": its name is not UTF-8 and cannot stand in scene.foam; rename it, in the "
                    "COLMAP model too.");
  }
  return plan;
}

// Returns the options that determine the memory of a run.
TrainingOptions OptionsToPlan(const TrainingRun& run) {
  TrainingOptions options = TrainedOptions(run);
  if (run.block_sites > 0) {
    options.final_sites = static_cast<int>(run.block_sites);
    options.initial_sites = 0;
  }
  return options;
}

// Returns the memory that is available for photos and foam.
int64_t MemoryToPlan(const TrainingRun& run, int num_classes) {
  const RankGroup* const ranks = run.ranks;
  return AvailableMemory() -
         ExchangeBytes(run.training, num_classes, ranks == nullptr ? 1 : ranks->num_ranks());
}

// Divides the available memory between photos and foam, and logs the plan. Throws UserError where
// it does not suffice. The number of labels is not known yet: kUsualClasses with masks.
ImageMemory PlanRunMemory(const TrainingRun& run, const ScenePlan& plan) {
  const auto num_seeds = static_cast<int64_t>(plan.seeds.size());
  const int usual_classes = plan.masks.NumPaired() > 0 ? kUsualClasses : 0;
  const int64_t available = MemoryToPlan(run, usual_classes);
  const ImageMemory images = PlanImageMemory(run.image_cache_gb,
                                             plan,
                                             OptionsToPlan(run),
                                             MemoryOfSweep(run, plan),
                                             run.time_budget > 0,
                                             available);
  LOG(INFO) << "Memory for " << NumDrawn(plan) << " photos: "
            << PlanMemory(OptionsToPlan(run), usual_classes, num_seeds, images.bytes).Report()
            << ", " << FormatBytes(available) << " available";
  RequireMemory(OptionsToPlan(run), usual_classes, num_seeds, images.bytes, available);
  return images;
}

// Returns what is known of the photos of a run that trains one block, and leaves those from which
// it draws nothing out of the plan's drawn ones. Returns nothing for other runs, and where the file
// is of other photos: then all are read, and the checksums tell what has changed.
std::optional<SceneFindings> FindKnown(const TrainingRun& run, ScenePlan* plan) {
  if (run.known_findings.empty()) return std::nullopt;
  std::optional<SceneFindings> known = ReadSceneFindings(run.known_findings, *plan);
  if (!known) return std::nullopt;
  const std::set<std::string> drawn(run.block_photos.begin(), run.block_photos.end());
  for (const PhotoRecord& photo : plan->photos) plan->is_drawn.push_back(drawn.count(photo.name));
  return known;
}

// Loads the photos and masks, and logs what was found in them. Writes it into the run's
// findings_path, with the checksums of the files.
TrainingScene LoadAndReport(const TrainingRun& run,
                            ScenePlan plan,
                            const ImageMemory& images,
                            const SceneFindings* known,
                            const FileChecksums& checksums) {
  const auto all_bytes = static_cast<int64_t>(MemoryOf(plan).held);
  const int64_t num_drawn = NumDrawn(plan);
  if (images.holds_all) {
    LOG(INFO) << "Loading " << num_drawn << " photos (" << FormatBytes(all_bytes) << ")";
  } else {
    LOG(INFO) << "Of " << num_drawn << " photos (" << FormatBytes(all_bytes)
              << ") only the pixels that are drawn are kept, in up to "
              << FormatBytes(images.cache_bytes) << " (image_cache_gb)";
  }
  const bool keeps_findings = !run.findings_path.empty();
  TrainingScene scene = LoadScene(std::move(plan), images, known, keeps_findings);
  if (keeps_findings) {
    SceneFindings findings = scene.TakeFindings();
    findings.checksums = checksums;
    WriteSceneFindings(run.findings_path, findings);
  }
  if (run.when_labels_are_known) run.when_labels_are_known(scene.Labels());
  LOG(INFO) << scene.PhotoReport() << "; decoded and checked in "
            << Seconds(scene.SecondsDecoding());
  for (const std::string& warning : scene.Warnings()) LOG(WARNING) << warning;
  LogMasks(scene, run.scene.mask_consistency);
  if (scene.NumClasses() == 0) LOG(INFO) << "Without labels: training colour only.";
  return scene;
}

// Throws UserError where the memory does not suffice for the training of a loaded scene.
void RequireTrainingMemory(const TrainingRun& run,
                           const TrainingScene& scene,
                           const ImageMemory& images) {
  RequireMemory(OptionsToPlan(run),
                scene.NumClasses(),
                static_cast<int64_t>(scene.Plan().seeds.size()),
                images.holds_all ? 0 : images.bytes,
                MemoryToPlan(run, scene.NumClasses()));
}

// Logs the memory of a scene with more labels than PlanRunMemory expected. Throws UserError where
// it does not suffice.
void PlanMemoryOfLabels(const TrainingRun& run,
                        const TrainingScene& scene,
                        const ImageMemory& images) {
  if (scene.NumClasses() <= kUsualClasses) return;
  const auto num_seeds = static_cast<int64_t>(scene.Plan().seeds.size());
  LOG(INFO) << "Memory with " << scene.NumClasses() << " labels: "
            << PlanMemory(OptionsToPlan(run), scene.NumClasses(), num_seeds, images.bytes).Report();
  RequireTrainingMemory(run, scene, images);
}

// Chooses the schedule of a run with a time budget, of which `begin` was the beginning: the one of
// the checkpoint, or one that fits the time that is left. Returns the choice for later checkpoints.
CheckpointTexts ChooseSchedule(const TrainingScene& scene,
                               const ImageMemory& images,
                               std::chrono::steady_clock::time_point begin,
                               const Checkpoint* checkpoint,
                               TrainingRun* run) {
  if (checkpoint != nullptr) {
    StateReader chosen("chosen_options", *checkpoint);
    run->training.Serialize(&chosen);
  } else {
    FitToBudget(scene, begin, run);
    RequireTrainingMemory(*run, scene, images);
  }
  CheckpointContents contents;
  StateWriter chosen("chosen_options", &contents);
  run->training.Serialize(&chosen);
  return std::move(contents.texts);
}

// Logs the effects that were chosen and the schedule of the training.
void LogTrainingPlan(const TrainingRun& run, const SceneEffects& effects) {
  for (const std::string& line : EffectsTable(effects)) LOG(INFO) << line;
  LOG(INFO) << "Training with " << Millions(run.training.num_rays) << " rays, up to "
            << TrainedOptions(run).final_sites << " sites, SH degree " << run.training.sh_degree
            << ", " << run.device.Description();
  if (run.ranks != nullptr) {
    LOG(INFO) << "Each of " << run.ranks->num_ranks()
              << (run.ranks->num_ranks() == 1 ? " rank" : " ranks") << " casts a share of the rays";
  }
}

// Logs how the training ended. With a time budget, stores in `run` and reports the schedule that
// was trained.
void ReportTraining(const TrainingSummary& summary, TrainingRun* run) {
  LOG(INFO) << summary.BriefReport();
  if (run->scene.test_every == 0) {
    LOG(INFO) << "No photo is held out, so the quality on new views is not known; test_every = 8 "
                 "would hold out every 8th photo and measure it there.";
  }
  if (run->time_budget > 0) {
    run->training.seconds = 0;
    run->training.late_rays = summary.late_rays;
    auto schedule = ScheduleTexts(run->training);
    schedule.emplace_back("sweep_photos", FormatValue(run->sweep_photos));
    if (run->when_schedule_is_known) run->when_schedule_is_known(schedule);
  }
}

// Logs how many cells have the colours of their neighbours.
void ReportHiddenCells(const TrainingSummary& summary) {
  const HiddenCellChanges& changes = summary.hidden_cells;
  if (changes.recolored + changes.filled == 0) return;
  LOG(INFO) << "Of " << summary.foam.NumSites() << " cells, " << changes.recolored
            << " opaque ones that photos hardly see have the colours of their neighbours, and "
            << changes.filled << " that no photo sees are shown as opaque";
}

// Logs how many cells were cleared away.
void ReportHangingCells(const TrainingSummary& summary) {
  if (summary.hanging_cells == 0) return;
  LOG(INFO) << summary.hanging_cells
            << (summary.hanging_cells == 1 ? " large cell that hung" : " large cells that hung")
            << " before cameras, not needed to explain the photos, became transparent";
}

// Logs how labels were spread, and which are smaller than cells. `labels` [classes].
void ReportLabels(const TrainingSummary& summary, const std::vector<Label>& labels) {
  if (summary.spreading) {
    LOG(INFO) << "Few photos have masks: their labels were spread along the surfaces to all cells; "
              << summary.spreading->changed_cells << " of " << summary.foam.NumSites()
              << " cells changed their label";
    WarnOfSmallLabels(*summary.spreading, labels);
  } else if (summary.foam.HasSemantics()) {
    std::vector<Label> small;
    std::vector<bool> has_cells(labels.size(), false);
    for (const ClassIndex c : ClassesOfCells(summary.foam)) has_cells[Value(c)] = true;
    for (size_t k = 0; k < labels.size(); ++k) {
      if (!has_cells[k]) small.push_back(labels[k]);
    }
    if (!small.empty()) {
      LOG(INFO) << "No cell has the label" << (small.size() == 1 ? " " : "s ") << NamesOf(small)
                << ": the training is too short for the masks, or they show too little of "
                << (small.size() == 1 ? "it" : "them")
                << "; more sites (final_sites) and rays (num_rays) would be right.";
    }
  }
}

// Logs warnings about a foam that may be damaged or of poor quality.
void LogWarnings(const TrainingSummary& summary) {
  if (summary.step_limit_hits > 0 || summary.nonfinite_gradients > 0) {
    LOG(WARNING) << "The foam may be damaged: " << summary.step_limit_hits
                 << " rays hit the step limit, " << summary.nonfinite_gradients
                 << " updates were skipped; both should be 0.";
  }
  if (summary.nonfinite_pixels > 0) {
    // Photos hold whole numbers; only ReferenceColor makes others.
    LOG(INFO) << summary.nonfinite_pixels
              << " of the drawn pixels are saturated in photos brighter "
              << "than the reference exposure and were left out.";
  }
  if (summary.unstable_iterations > 0) {
    LOG(WARNING) << "The run was unstable for " << summary.unstable_iterations
                 << " iterations and recovered; lower learning rates would be right.";
  }
  if (summary.explained_contrast < kLeastExplainedContrast) {
    LOG(WARNING) << "The foam shows only "
                 << std::lround(100 * std::max(0.0, summary.explained_contrast))
                 << " % of the contrast of the training photos; more rays, lower learning rates or "
                 << "better camera poses would be right.";
  }
}

// Writes scene.foam, effects.json and training_log.csv, and ends the training of `folder`; or gives
// the result to the run's take_result.
Model WriteResult(const TrainingRun& run,
                  const TrainingScene& scene,
                  const SceneEffects& effects,
                  TrainingSummary summary,
                  TrainingFolder* folder) {
  Model model;
  model.foam = std::move(summary.foam);
  model.statistics = std::move(summary.statistics);
  model.world_from_normalized = scene.WorldFromNormalized();
  model.labels = scene.Labels();
  model.photos = scene.Photos();
  model.options = ModelOptions(run, effects);
  if (run.take_result) {
    run.take_result(model, summary.log);
    return model;
  }
  WriteRefinedPoses(
      run.scene.input_path, model.photos, effects.Find("poses"), folder->path() / "sparse" / "0");
  WriteModel(folder->path() / "scene.foam", model);
  WriteEffects(folder->path() / "effects.json", effects, scene.Photos());
  WriteTextFile(folder->path() / "training_log.csv", FormatTrainingLog(summary.log));
  if (run.when_written) run.when_written(summary.log, *folder);
  folder->EndTraining();
  return model;
}

}  // namespace

void CompleteFromWorkspace(const std::filesystem::path& workspace, TrainingRun* run) {
  if (!std::filesystem::is_directory(workspace)) {
    throw UserError(workspace.string(),
                    ": there is no such folder; a workspace is the folder that holds images/ and "
                    "sparse/.");
  }
  if (run->scene.image_path.empty()) run->scene.image_path = workspace / "images";
  if (run->scene.input_path.empty()) run->scene.input_path = workspace / "sparse";
  run->scene.workspace_path = workspace;
}

void WriteRefinedPoses(const std::filesystem::path& input_path,
                       const std::vector<PhotoRecord>& photos,
                       const Effect& poses,
                       const std::filesystem::path& model_path) {
  namespace fs = std::filesystem;
  const fs::path mark = model_path / "refined_poses.txt";
  std::error_code error;
  const bool is_input = fs::equivalent(FindModelFolder(input_path), model_path, error);
  const bool is_ours = !is_input && fs::exists(mark);
  if (poses.on && !is_ours && fs::exists(model_path) && !fs::is_empty(model_path)) {
    LOG(WARNING) << model_path.string()
                 << ": holds files that no training wrote, so the model with refined poses is not "
                    "written there; scene.foam has the poses. Another output_path would be right.";
  } else if (poses.on) {
    fs::create_directories(model_path);
    WriteTextFile(mark, poses.evidence + "\n");
    WriteRefinedModel(input_path, photos, model_path);
  } else if (is_ours) {
    for (const char* name : {"cameras", "frames", "images", "points3D", "rigs"}) {
      for (const char* extension : {".bin", ".txt"}) {
        fs::remove(model_path / (std::string(name) + extension), error);
      }
    }
    fs::remove(mark, error);
    LOG(WARNING) << "Removed the model in " << model_path.string()
                 << ": its poses are of the foam that was here before.";
  }
}

void CompleteTrainingRun(TrainingRun* run) {
  run->effects.sh_degree = run->training.sh_degree;
  run->training.fixed_sh_degree = run->effects.fixed_sh_degree;
  run->scene.use_masks = run->effects.semantics;
  run->scene.distortion = run->effects.distortion;
  run->scene.random_seed = run->training.random_seed;
  if (const std::string wrong = run->training.Check(); !wrong.empty()) {
    const size_t end_of_name = wrong.find(' ');
    throw FieldError(wrong.substr(0, end_of_name), wrong.substr(end_of_name));
  }
  if (run->scene.max_image_size != -1 && run->scene.max_image_size < 1) {
    throw FieldError("max_image_size",
                     " is ",
                     run->scene.max_image_size,
                     "; it must be a number of pixels from 1 on, or -1 for photos as they are.");
  }
  if (run->image_cache_gb != -1 && !(run->image_cache_gb > 0 && run->image_cache_gb <= 1e6)) {
    throw FieldError(
        "image_cache_gb",
        " is ",
        run->image_cache_gb,
        "; it must be a number of GB greater than 0 and up to 1000000, or -1 to choose "
        "by the memory that is free.");
  }
  if (run->sweep_photos < 0) {
    throw FieldError("sweep_photos",
                     " is ",
                     run->sweep_photos,
                     "; it must be a number of photos, or 0 for none.");
  }
  if (run->time_budget < 0) {
    throw FieldError("time_budget",
                     " is ",
                     run->time_budget,
                     "; it must be a number of seconds, or 0 for none.");
  }
}

void TakeSchedule(const TrainingOptions& schedule,
                  const std::set<std::string>& kept_options,
                  TrainingOptions* training) {
  const auto take = [&](const char* name, auto TrainingOptions::*field) {
    if (kept_options.count(name) == 0) training->*field = schedule.*field;
  };
  take("num_rays", &TrainingOptions::num_rays);
  take("rays_per_iteration", &TrainingOptions::rays_per_iteration);
  take("final_sites", &TrainingOptions::final_sites);
  take("sh_degree", &TrainingOptions::sh_degree);
  take("densify_events", &TrainingOptions::densify_events);
}

std::vector<std::pair<std::string, std::string>> ScheduleTexts(const TrainingOptions& training) {
  return {{"num_rays", FormatValue(training.num_rays)},
          {"late_rays", FormatValue(training.late_rays)},
          {"rays_per_iteration", FormatValue(training.rays_per_iteration)},
          {"final_sites", FormatValue(training.final_sites)},
          {"sh_degree", FormatValue(training.sh_degree)},
          {"densify_events", FormatValue(training.densify_events)}};
}

bool Sweeps(const TrainingRun& run) { return run.sweep_photos > 0 && run.scene.seed_path.empty(); }

SweepFindings AddSurfaceSeeds(const TrainingRun& run, TrainingScene* scene) {
  SweepFindings findings;
  findings.sky.name = "sky";
  findings.sky.by_option = !run.effects.sky;
  findings.sky.evidence = "not looked for";
  findings.sky.cost = Plural(kMostSkySeeds, "cell") + " more at most";
  const bool is_of_block = !run.block_seeds.empty();
  if (is_of_block) scene->SetGround(run.block_ground);
  if (!Sweeps(run)) return findings;
  SurfaceSeeds found = run.known_sweep.empty()
                           ? FindSurfaceSeeds(*scene, run.sweep_photos, run.effects.sky)
                           : ReadSurfaceSeeds(run.known_sweep, scene->NumViews());
  if (!run.sweep_path.empty()) WriteSurfaceSeeds(run.sweep_path, found);
  if (run.effects.sky) DescribeSky(found, &findings.sky);
  if (is_of_block) {
    for (size_t view = 0; view < found.depths.size(); ++view) {
      if (!scene->Plan().IsDrawn(view)) found.depths[view] = {};
    }
  } else {
    findings.report = found.Report();
    scene->SetGround(found.solid_ground);
    scene->AddSeeds(std::move(found.points));
  }
  if (run.training.distance_weight > 0) scene->SetDepths(std::move(found.depths));
  return findings;
}

TrainingScene LoadScene(const TrainingRun& run, const SceneOptions& scene) {
  ScenePlan plan = PlanScene(scene);
  const ImageMemory images = PlanImageMemory(run.image_cache_gb,
                                             plan,
                                             run.training,
                                             MemoryOfSweep(run, plan),
                                             /*draws_any_number=*/false,
                                             AvailableMemory());
  return LoadScene(std::move(plan), images);
}

void LogWarnings(const TrainingScene& scene) {
  for (const std::string& warning : scene.Plan().warnings) LOG(WARNING) << warning;
  for (const std::string& warning : scene.Warnings()) LOG(WARNING) << warning;
}

void LogMasks(const TrainingScene& scene, MaskConsistency consistency) {
  LOG(INFO) << scene.MaskReport();
  if (scene.NumClasses() == 0) return;
  if (consistency != MaskConsistency::kOff) LOG(INFO) << scene.Consistency().Line();
  if (scene.Labels()[0].id == kNoObject) {
    LOG(INFO) << "Id 0 of the masks is learned as a class of its own, the background.";
  }
}

Model TrainAndWrite(TrainingFolder* folder, TrainingRun* run) {
  const auto begin = std::chrono::steady_clock::now();
  std::optional<OnInterrupt> log_stop([] {
    LOG(INFO) << "Stopped before the first iteration; the same command starts again from the same "
                 "files.";
  });
  RankGroup* const ranks = run->ranks;
  ImportMasksOnce(ranks, folder->path() / "imported_masks", &run->scene);
  if (IsFirstRank(ranks) && folder->preview_every() > 0) {
    RequireReplaceablePreviews(PreviewFolder(*folder));
  }
  ScenePlan plan = PlanRun(*run);
  std::optional<SceneFindings> known = FindKnown(*run, &plan);
  const ImageMemory images = PlanRunMemory(*run, plan);
  const FileChecksums checksums = ChecksumsOfFiles(plan, known ? &known->checksums : nullptr);
  const CheckpointTexts identity = IdentityOf(*run, plan, checksums);
  RequireOneRun(ranks, identity);
  folder->SetIdentity(identity);
  if (FromFirstRank(ranks, IsFirstRank(ranks) && folder->IsTrained())) {
    return IsFirstRank(ranks) ? ReadModel(folder->path() / "scene.foam") : Model();
  }
  std::unique_ptr<Checkpoint> checkpoint = NewestCheckpointOf(ranks, run->device.kind(), folder);
  if (checkpoint == nullptr && run->begin_from) {
    checkpoint = folder->CheckpointAt(run->begin_from(), run->device.kind());
  }

  TrainingScene scene =
      LoadAndReport(*run, std::move(plan), images, known ? &*known : nullptr, checksums);
  known.reset();
  PlanMemoryOfLabels(*run, scene, images);

  PoseRefiner poses(&scene, run->effects.poses);
  poses.RefineByTracks();
  if (poses.IsOn()) LOG(INFO) << poses.Report();

  // The probe and the plane sweep take some of a time budget, so they come before the schedule is
  // chosen.
  SceneEffects effects = ProbeEffects(scene, run->effects);
  scene.SetLights(effects.lights);
  scene.SetPassesPerDraw(effects.passes_per_draw);
  if (run->time_budget > 0) {
    run->sweep_photos = std::min(run->sweep_photos, SweptPhotosWithin(run->time_budget));
  }
  const SweepFindings sweep = AddSurfaceSeeds(*run, &scene);
  if (!sweep.report.empty()) LOG(INFO) << sweep.report;
  CheckpointTexts texts;
  texts["labels"] = LabelTexts(scene.Labels());
  if (run->time_budget > 0) {
    texts.merge(ChooseSchedule(scene, images, begin, checkpoint.get(), run));
    run->effects.sh_degree = run->training.sh_degree;
    ChooseShDegree(run->effects, &effects);
  }
  run->training.sh_degree = effects.sh_degree;
  LogTrainingPlan(*run, effects);
  const std::vector<SeedPoint> seeds =
      run->block_seeds.empty() ? StartingSeeds(scene.Seeds(), run->training) : run->block_seeds;
  if (const std::string report = CloudReport(*run, scene, seeds); !report.empty()) {
    LOG(INFO) << report;
  }

  ViewAdaptation adaptation(
      &scene, run->effects, effects.lights, std::move(poses), run->training.num_rays);
  // Defers signals that arrive after the last iteration has begun until the result is written.
  const DeferInterruption until_written;
  log_stop.reset();
  TrainingSummary summary;
  const auto add_adaptations = [&] {
    effects.effects.push_back(sweep.sky);
    effects.effects.push_back(adaptation.transients().MakeEffect());
    effects.effects.push_back(adaptation.light().MakeEffect());
    effects.effects.push_back(adaptation.poses().MakeEffect());
    effects.lights = adaptation.light().lights();
  };
  try {
    summary = Train(scene, seeds, *run, texts, std::move(checkpoint), &adaptation, folder);
  } catch (const TrainingStopped&) {
    add_adaptations();
    if (run->when_stopped) run->when_stopped({scene, seeds, effects, ModelOptions(*run, effects)});
    throw;
  }
  add_adaptations();
  ReportTraining(summary, run);
  ReportHangingCells(summary);
  ReportHiddenCells(summary);
  ReportLabels(summary, scene.Labels());
  LogWarnings(summary);
  if (!IsFirstRank(ranks)) return {};
  Model model = WriteResult(*run, scene, effects, std::move(summary), folder);
  if (const int signal = InterruptionRequested()) {
    folder->LogHowToResumeAfterTraining();
    throw Interruption(signal);
  }
  return model;
}

}  // namespace semfoam
