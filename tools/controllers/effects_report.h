// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photometric/effects.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Returns the table of the probe: a head line and one line for each effect, with the evidence, the
// decision and the cost.
std::vector<std::string> EffectsTable(const SceneEffects& effects);

// Returns the text of effects.json: {"version": 1, "effects": [{"effect", "on", "decided_by",
// "evidence", "measures", "cost"}, ...], "sh_degree": n}; and, only where exposure or vignetting is
// on, "photos": {name: {"gain": [r, g, b], "falloff": [a, b], "held_out": true or false}} (see
// PhotoLight). `photos` are the views of `effects`.
std::string EffectsJson(const SceneEffects& effects, const std::vector<PhotoRecord>& photos);

// Writes effects.json. Throws UserError where the file cannot be written.
void WriteEffects(const std::filesystem::path& path,
                  const SceneEffects& effects,
                  const std::vector<PhotoRecord>& photos);

// Returns the light of each photo, by its name in a file of WriteEffects; empty where there is no
// file, or none of photos (no effect is on). Photos that it does not name have the reference light.
// Throws UserError where the file is damaged.
std::vector<PhotoLight> ReadLights(const std::filesystem::path& path,
                                   const std::vector<PhotoRecord>& photos);

}  // namespace semfoam
