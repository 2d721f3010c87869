// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photometric/effects.h"
#include "tools/cli/option_manager.h"

#include <filesystem>
#include <string>
#include <vector>

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

// The probe's table: a head line and one line for each effect, with what was found, what follows
// and what it costs.
std::vector<std::string> EffectsTable(const SceneEffects& effects);

// effects.json: {"version": 1, "effects": [{"effect", "on", "decided_by", "evidence", "measures",
// "cost"}, ...], "sh_degree": n}; and, only where exposure or vignetting is on, "photos": {name:
// {"gain": [r, g, b], "falloff": [a, b], "held_out": true or false}} (see PhotoLight). `photos` are
// the views of `effects`. Throws UserError where the file cannot be written.
void WriteEffects(const std::filesystem::path& path,
                  const SceneEffects& effects,
                  const std::vector<PhotoRecord>& photos);

}  // namespace semfoam
