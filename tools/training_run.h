// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model.h"
#include "foam/trainer.h"
#include "plugin/effects.h"
#include "plugin/scene.h"
#include "tools/effects_options.h"
#include "tools/option_manager.h"

#include <filesystem>
#include <string>

namespace semfoam {

// What a training is made from, as the commands' options give it.
struct TrainingRun {
  SceneOptions scene;
  std::string quality = "medium";
  TrainingOptions training;
  EffectsOptions effects;

  // As the options spell them; Finish() brings them into `scene` and `effects`.
  std::string image_path;
  std::string input_path;
  std::string mask_path;
  std::string labels_path;
  std::string label_zero = "auto";
  EffectsChoices effects_choices;
};

// Adds --mask_path, --labels_path, --test_every, --quality, --FoamTraining.* and --Effects.*.
void AddTrainingRunOptions(OptionManager* options, TrainingRun* run);

// To be called after Parse, before any work: completes `run` and throws UserError when an option is
// out of range.
void FinishTrainingRun(const OptionManager& options, TrainingRun* run);

// Loads the photos and masks, probes which effects they call for, says what was found and what is
// going to be done, trains, and writes scene.foam, effects.json and training_log.csv into
// `output_path`. Returns the model. The model's options are those that shape the result: quality,
// random_seed, test_every and --FoamTraining.*, with the SH degree that was trained; and
// "exposure" and "vignetting", but only where they are on.
Model TrainAndWrite(const OptionManager& options,
                    const TrainingRun& run,
                    const std::filesystem::path& output_path);

}  // namespace semfoam
