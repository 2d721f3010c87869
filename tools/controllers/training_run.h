// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/train/trainer.h"
#include "plugin/dataset/scene.h"
#include "plugin/photometric/effects.h"
#include "tools/cli/option_manager.h"
#include "tools/controllers/effects_options.h"
#include "tools/controllers/mask_options.h"
#include "tools/controllers/training_folder.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace semfoam {

// What a training is made from, as the commands' options give it.
struct TrainingRun {
  SceneOptions scene;
  std::string quality = "medium";
  TrainingOptions training;
  double time_budget = 0;  // seconds for all that foam_trainer does; 0 = as `training` says
  EffectsOptions effects;
  double image_cache_gb = -1;  // see PlanImageMemory

  // Called, where given, when the scene is planned and no photo is read yet, and when the labels
  // are known and nothing is trained yet: to refuse what would fail only afterwards.
  std::function<void(const ScenePlan&)> when_planned;
  std::function<void(const std::vector<Label>&)> when_labels_are_known;

  // As the options spell them; Finish() brings them into `scene` and `effects`.
  std::string image_path;
  std::string input_path;
  MaskOptions masks;
  EffectsChoices effects_choices;
};

// Adds --mask_path, --labels_path, --test_every, --image_cache_gb, --quality, --Masks.*,
// --FoamTraining.* and
// --Effects.*.
void AddTrainingRunOptions(OptionManager* options, TrainingRun* run);

// What the user did not give is looked for where COLMAP and mask trackers put it: images/, sparse/,
// object_mask/ or Annotations/ in `workspace`. Throws UserError where that is no folder.
void CompleteFromWorkspace(const std::filesystem::path& workspace, TrainingRun* run);

// Takes from `schedule` how long, how large and how detailed a training is (what the presets
// preset), except for what the user gave by name.
void TakeSchedule(const OptionManager& options,
                  const TrainingOptions& schedule,
                  TrainingOptions* training);

// To be called after Parse, before any work: completes `run` and throws UserError when an option is
// out of range.
void FinishTrainingRun(const OptionManager& options, TrainingRun* run);

// The scene that the options name, loaded within --image_cache_gb.
TrainingScene LoadScene(const TrainingRun& run, const SceneOptions& scene);

// Logs what a user should know of a scene: the warnings of its plan and its own.
void LogWarnings(const TrainingScene& scene);

// Loads the photos and masks, probes which effects they call for, says what was found and what is
// going to be done, trains, and writes scene.foam, effects.json and training_log.csv and, with
// held-out views, training_plot.svg and .png into `folder`, and checkpoints on the way. With
// --resume, goes on where an earlier process was stopped, after training too; its result has the
// same bytes, the log apart. SIGINT and SIGTERM end it after the iteration, with a checkpoint and
// the command that goes on from it. Returns the model. The model's
// options are those that shape the result: quality, random_seed, test_every, --Masks.* and
// --FoamTraining.*, with the SH degree that was trained at most; and "exposure" and "vignetting",
// but only where they are on. With a time budget, `run` leaves with the schedule that was chosen,
// the model holds that, and so do the options: given without a budget, they give the same bytes.
Model TrainAndWrite(const OptionManager& options, TrainingFolder* folder, TrainingRun* run);

}  // namespace semfoam
