// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/training_run.h"

#include "foam/available_memory.h"
#include "foam/error.h"
#include "foam/memory_plan.h"
#include "foam/output_file.h"
#include "foam/parallel.h"
#include "tools/presets.h"
#include "tools/progress.h"
#include "tools/training_log.h"
#include "tools/training_options.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <utility>
#include <vector>

#include <glog/logging.h>
#include <unistd.h>

namespace semfoam {
namespace {

// A foam that shows less of the photos' contrast than this has hardly learned them.
constexpr double kLeastExplainedContrast = 0.5;

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

std::map<std::string, std::string> ModelOptions(const OptionManager& options,
                                                const TrainingRun& run,
                                                const SceneEffects& effects) {
  std::map<std::string, std::string> values = options.GroupValues("FoamTraining");
  values["sh_degree"] = FormatValue(effects.sh_degree);
  for (const char* name : {"exposure", "vignetting"}) {
    if (effects.Find(name).on) values[name] = FormatValue(true);
  }
  values["quality"] = run.quality;
  values["random_seed"] = FormatValue(options.RandomSeed());
  values["test_every"] = FormatValue(run.scene.test_every);
  return values;
}

TrainingSummary Train(const TrainingScene& scene,
                      const TrainingOptions& training,
                      std::vector<TrainingProgress>* reports) {
  ProgressLine line(std::cerr, ::isatty(STDERR_FILENO) != 0);
  return TrainFoam(
      scene, scene.Seeds(), scene.NumClasses(), training, [&](const TrainingProgress& progress) {
        reports->push_back(progress);
        line.Update(progress);
      });
}

}  // namespace

void AddTrainingRunOptions(OptionManager* options, TrainingRun* run) {
  options->AddDefaultOption("mask_path",
                            &run->mask_path,
                            "folder of the instance masks; by default object_mask/, then "
                            "Annotations/");
  options->AddDefaultOption(
      "labels_path",
      &run->labels_path,
      "names of the labels, {\"labels\": {\"7\": \"mug\"}}; by default labels.json beside the "
      "masks' folder");
  options->AddDefaultOption("test_every",
                            &run->scene.test_every,
                            "hold out every so many photos by name, from the first; 0 = none");
  AddTrainingOptions(options, &run->quality, &run->training);
  options->AddChoiceOption("FoamTraining.label_zero",
                           &run->label_zero,
                           {"auto", "ignore", "class"},
                           "what id 0 of the masks is: unlabelled, or the class of what is no "
                           "object; auto = a class where it covers a fifth of the masks");
  AddEffectsOptions(options, &run->effects_choices);
}

void FinishTrainingRun(const OptionManager& options, TrainingRun* run) {
  run->training.random_seed = options.RandomSeed();
  run->scene.image_path = run->image_path;
  run->scene.input_path = run->input_path;
  run->scene.mask_path = run->mask_path;
  run->scene.labels_path = run->labels_path;
  run->scene.label_zero = run->label_zero == "class"    ? LabelZero::kClass
                          : run->label_zero == "ignore" ? LabelZero::kIgnore
                                                        : LabelZero::kAuto;
  run->effects = MakeEffectsOptions(run->effects_choices);
  run->effects.sh_degree = run->training.sh_degree;
  run->effects.fixed_sh_degree = options.IsGiven("FoamTraining.sh_degree");
  run->scene.use_masks = run->effects.semantics;
  run->scene.distortion = run->effects.distortion;
  run->scene.random_seed = options.RandomSeed();
  if (const std::string wrong = run->training.Check(); !wrong.empty()) {
    throw UserError("Failed to parse options - ", wrong);
  }
}

Model TrainAndWrite(const OptionManager& options,
                    const TrainingRun& run,
                    const std::filesystem::path& output_path) {
  ScenePlan plan = PlanScene(run.scene);
  const auto photo_bytes = static_cast<int64_t>(plan.MemoryBytes());
  const auto num_seeds = static_cast<int64_t>(plan.seeds.size());
  const bool has_semantics = plan.masks.NumPaired() > 0;
  const int64_t available = AvailableMemory();
  LOG(INFO) << "Memory for " << plan.files.size() << " photos: "
            << PlanMemory(run.training, has_semantics, num_seeds, photo_bytes).Report() << ", "
            << FormatBytes(available) << " available";
  RequireMemory(run.training, has_semantics, num_seeds, photo_bytes, available);
  LOG(INFO) << "Loading " << plan.files.size() << " photos (" << FormatBytes(photo_bytes) << ")";
  TrainingScene scene(std::move(plan));
  LOG(INFO) << scene.PhotoReport() << "; decoded and checked in "
            << Seconds(scene.SecondsDecoding());
  LOG(INFO) << scene.MaskReport();
  if (scene.NumClasses() > 0 && scene.Labels()[0].id == 0) {
    LOG(INFO) << "Id 0 of the masks is learned as a class of its own, the background.";
  }
  if (scene.NumClasses() == 0) LOG(INFO) << "Without labels: training colour only.";
  const SceneEffects effects = ProbeEffects(scene, run.effects);
  for (const std::string& line : EffectsTable(effects)) LOG(INFO) << line;
  scene.SetLights(effects.lights);
  TrainingOptions training = run.training;
  training.sh_degree = effects.sh_degree;
  LOG(INFO) << "Training with " << Millions(training.num_rays) << " rays, up to "
            << training.final_sites << " sites, SH degree " << training.sh_degree << ", "
            << NumThreads() << (NumThreads() == 1 ? " thread" : " threads");

  std::vector<TrainingProgress> reports;
  TrainingSummary summary = Train(scene, training, &reports);
  LOG(INFO) << summary.BriefReport();
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

  Model model;
  model.foam = std::move(summary.foam);
  model.statistics = std::move(summary.statistics);
  model.world_from_normalized = scene.WorldFromNormalized();
  model.labels = scene.Labels();
  model.photos = scene.Photos();
  model.options = ModelOptions(options, run, effects);
  WriteModel(output_path / "scene.foam", model);
  WriteEffects(output_path / "effects.json", effects, scene.Photos());
  WriteTextFile(output_path / "training_log.csv", FormatTrainingLog(reports));
  return model;
}

}  // namespace semfoam
