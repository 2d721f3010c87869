// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photometric/effects.h"
#include "tools/cli/option_manager.h"

#include <string>

namespace semfoam {

// The user's say in what is simulated, as the options spell it.
struct EffectsChoices {
  std::string exposure = "auto";
  std::string white_balance = "auto";
  std::string vignetting = "auto";
  std::string distortion = "auto";
  std::string semantics = "auto";
  std::string sh_degree = "auto";
};

// Adds --Effects.*.
void AddEffectsOptions(OptionManager* options, EffectsChoices* choices);

// To be called after Parse; which SH degree is left to the caller. Throws UserError where the
// choices contradict each other.
EffectsOptions MakeEffectsOptions(const EffectsChoices& choices);

}  // namespace semfoam
