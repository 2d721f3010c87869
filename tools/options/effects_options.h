// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photometric/effects.h"
#include "tools/cli/option_manager.h"

#include <string>

namespace semfoam {

// The user's choices of effects, as texts of the options.
struct EffectsChoices {
  std::string exposure = "auto";
  std::string white_balance = "auto";
  std::string vignetting = "auto";
  std::string shading = "auto";
  std::string transients = "auto";
  std::string sky = "auto";
  std::string blur = "auto";
  std::string poses = "auto";
  std::string distortion = "auto";
  std::string semantics = "auto";
  std::string sh_degree = "auto";
};

// Adds --Effects.*.
void AddEffectsOptions(OptionManager* options, EffectsChoices* choices);

// Converts the choices after Parse; the caller sets the SH degree. Throws UserError where the
// choices contradict each other.
EffectsOptions MakeEffectsOptions(const EffectsChoices& choices);

}  // namespace semfoam
