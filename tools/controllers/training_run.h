// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/model/model.h"
#include "foam/train/trainer.h"
#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photometric/effects.h"
#include "tools/controllers/presets.h"
#include "tools/controllers/training_folder.h"

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// What a training is made from. The seed is that of `training`; CompleteTrainingRun brings into
// `scene`, `training` and `effects` what they have in common.
struct TrainingRun {
  SceneOptions scene;
  // The preset that `training` was made from (OptionsForQuality), for the model to tell.
  std::string quality = "medium";
  TrainingOptions training = OptionsForQuality("medium");
  // Seconds for all of TrainAndWrite: chooses what presets preset, by the speed of this machine,
  // but for `kept_options`; 0 = as `training` says.
  double time_budget = 0;
  std::set<std::string> kept_options;  // names as in TrainingOptions: "num_rays"
  EffectsOptions effects;
  double image_cache_gb = -1;  // see PlanImageMemory
  Device device;               // to train on

  // Called, where given, when the scene is planned and no photo is read yet, and when the labels
  // are known and nothing is trained yet: to refuse what would fail only afterwards.
  std::function<void(const ScenePlan&)> when_planned;
  std::function<void(const std::vector<Label>&)> when_labels_are_known;
  // Called, where given, when a run with a time budget has trained, with what of TrainingOptions
  // the budget has chosen, by name: given without a budget, these make the same foam.
  std::function<void(const std::vector<std::pair<std::string, std::string>>&)>
      when_schedule_is_known;
  // Called, where given, when scene.foam, effects.json and training_log.csv are written and the
  // run does not count as trained yet, with the reports of the log.
  std::function<void(const std::vector<TrainingProgress>&, const TrainingFolder&)> when_written;
};

// Looks for what `run->scene` does not name where COLMAP and mask trackers put it: images/,
// sparse/, object_mask/ or Annotations/ in `workspace`. Throws UserError where that is no folder.
void CompleteFromWorkspace(const std::filesystem::path& workspace, TrainingRun* run);

// Copies the seed, the SH degree and the choices of `effects` to where else they are needed. Throws
// UserError, naming field and range, when a value is out of range. To be called before any work.
void CompleteTrainingRun(TrainingRun* run);

// Takes from `schedule` how long, how large and how detailed a training is (what the presets
// preset), except for `kept_options`.
void TakeSchedule(const TrainingOptions& schedule,
                  const std::set<std::string>& kept_options,
                  TrainingOptions* training);

// The schedule by the names of the options, in a fixed order: given without a budget they give the
// same bytes on any machine.
std::vector<std::pair<std::string, std::string>> ScheduleTexts(const TrainingOptions& training);

// The dataset that `scene` names, loaded within run.image_cache_gb.
TrainingScene LoadScene(const TrainingRun& run, const SceneOptions& scene);

// Logs what a user should know of a dataset: the warnings of its plan and its own.
void LogWarnings(const TrainingScene& scene);

// Loads the photos and masks, probes which effects they call for, logs what was found and what is
// going to be done, trains, and writes scene.foam, effects.json and training_log.csv into `folder`,
// and checkpoints on the way. With CheckpointOptions::resume, goes on where an earlier process was
// stopped, after training too; its result has the same bytes, the log apart. SIGINT and SIGTERM
// (after HandleInterruptions) end it after the iteration, with a checkpoint and the command that
// goes on from it. Returns the model. The model's options are those that shape the result: quality,
// random_seed, test_every, mask_consistency and the training's, with the SH degree that was trained
// at most; and "exposure" and "vignetting", but only where they are on. With a time budget, `run`
// leaves with the schedule that was chosen, and the model holds that. Throws UserError for what is
// wrong with the input, Interruption after a signal.
Model TrainAndWrite(TrainingFolder* folder, TrainingRun* run);

}  // namespace semfoam
