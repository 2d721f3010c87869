// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"
#include "tools/options/effects_options.h"
#include "tools/options/mask_options.h"

#include <string>

namespace semfoam {

// A training as the options of a command spell it.
struct TrainingRunOptions {
  TrainingRun run;  // complete after FinishTrainingRun
  std::string image_path;
  std::string input_path;
  MaskOptions masks;
  EffectsChoices effects;
};

// Adds --device, --mask_path, --labels_path, --test_every, --image_cache_gb, --quality, --Masks.*,
// --FoamTraining.* and --Effects.*. The preset is taken first; what the user gives by name wins
// over it.
void AddTrainingRunOptions(OptionManager* options, TrainingRunOptions* training);

// Adds --checkpoint_every, --resume and --overwrite.
void AddCheckpointOptions(OptionManager* options, CheckpointOptions* checkpoints);

// To be called after Parse, before any work: completes `training->run`, with what is found in
// `workspace_path` unless that is empty, and throws UserError when an option is out of range.
void FinishTrainingRun(const OptionManager& options,
                       const std::string& workspace_path,
                       TrainingRunOptions* training);

// The command that goes on with a run of `options` that was stopped, to be pasted into a shell.
std::string ResumeCommand(const OptionManager& options);

}  // namespace semfoam
