// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <string>
#include <vector>

namespace semfoam {

// Returns the names of the presets, from the fastest to the best: low, medium, high, extreme.
const std::vector<std::string>& Qualities();

// Returns the options of a preset: numbers of rays and sites, never seconds, so that the result
// does not depend on the speed of the machine. CHECKs that `quality` is one of Qualities().
TrainingOptions OptionsForQuality(const std::string& quality);

}  // namespace semfoam
