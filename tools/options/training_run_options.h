// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"
#include "tools/options/effects_options.h"
#include "tools/options/mask_options.h"

#include <string>

namespace semfoam {

// Options of a command that trains.
struct TrainingRunOptions {
  // Complete after FinishTrainingRun.
  TrainingRun run;
  std::string image_path;
  std::string input_path;
  std::string seed_path;
  std::string ignore_path;
  MaskOptions masks;
  EffectsChoices effects;
};

// Adds --device, --mask_path, --labels_path, --ignore_path, --invert, --seed_path, --test_every,
// --image_cache_gb, --quality, --progress, --Masks.*, --FoamTraining.* and --Effects.*. The preset
// is applied first; options that the user gives by name override it.
void AddTrainingRunOptions(OptionManager* options, TrainingRunOptions* training);

// Adds --checkpoint_every, --preview_every, --resume and --overwrite.
void AddCheckpointOptions(OptionManager* options, CheckpointOptions* checkpoints);

// Completes `training->run`, with the folders found in `workspace_path` unless that is empty.
// Throws UserError when an option is out of range. Must be called after Parse and before any work.
void FinishTrainingRun(const OptionManager& options,
                       const std::string& workspace_path,
                       TrainingRunOptions* training);

// Throws UserError where the run would write over --seed_path: it is in `output_path` under the
// name of a file that a training or an export writes. Must be called before any work.
void RequireSeedCloudIsKept(const TrainingRunOptions& training, const std::string& output_path);

// Returns the shell command that resumes a stopped run with `options`.
std::string ResumeCommand(const OptionManager& options);

}  // namespace semfoam
