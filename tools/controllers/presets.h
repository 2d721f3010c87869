// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <string>
#include <vector>

namespace semfoam {

// The presets, from the quickest to the best: low, medium, high, extreme.
const std::vector<std::string>& Qualities();

// Numbers of rays and sites, never of seconds: how fast the machine is changes no byte.
// CHECKs that `quality` is one of Qualities().
TrainingOptions OptionsForQuality(const std::string& quality);

}  // namespace semfoam
