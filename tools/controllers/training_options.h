// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "tools/cli/option_manager.h"

#include <string>

namespace semfoam {

// Adds --quality and --FoamTraining.*. The preset is taken first; what the user gives by name wins
// over it. `quality` holds the default preset before and the chosen one after Parse.
void AddTrainingOptions(OptionManager* options, std::string* quality, TrainingOptions* training);

}  // namespace semfoam
