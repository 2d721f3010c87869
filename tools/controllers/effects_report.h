// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/photometric/effects.h"
#include "plugin/photometric/expected_light.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

// Returns the table of the probe: a head line and one line for each effect, with the evidence, the
// decision and the cost.
std::vector<std::string> EffectsTable(const SceneEffects& effects);

// Returns the text of effects.json: {"version": 1, "effects": [{"effect", "on", "decided_by",
// "evidence", "measures", "cost"}, ...], "sh_degree": n}; and, only where exposure or vignetting is
// on, "photos": {name: {"gain": [r, g, b], "falloff": [a, b], "shading": [of r, g, b], "tone":
// [rows], "lens": n, "held_out": true or false}} (see PhotoLight). `photos` are the views of
// `effects`.
std::string EffectsJson(const SceneEffects& effects, const std::vector<PhotoRecord>& photos);

// Writes effects.json. Throws UserError where the file cannot be written.
void WriteEffects(const std::filesystem::path& path,
                  const SceneEffects& effects,
                  const std::vector<PhotoRecord>& photos);

// The light and the lens of each photo.
struct PhotoLights {
  std::vector<PhotoLight> lights;
  std::vector<int> lenses;
};

// Returns those of each photo by its name in a file of WriteEffects; empty where there is no file,
// or none of photos (no effect is on). Photos that it does not name have the reference light and
// the lens -1. Throws UserError where the file is damaged.
PhotoLights ReadLights(const std::filesystem::path& path, const std::vector<PhotoRecord>& photos);

// Returns whether the training took differences of the photos' light out ("exposure", "shading"
// among the model's options), so that photos compare with renders only up to their own light.
bool AdaptsLight(const Model& model);

// Copies the effects.json beside a foam, where there is one, to that beside a foam that was made of
// it, with the same photos, if their light differs (AdaptsLight): renders and textures need it.
// Else removes an effects.json that an earlier foam left there, and logs that: it would be taken
// for the light of this one. Throws UserError where it cannot be read, written or removed.
void CopyLight(const Model& model,
               const std::filesystem::path& foam_path,
               const std::filesystem::path& edited_path);

// Returns the lights that renders of a foam are best held against photos in, from the effects.json
// beside it; nothing where the photos of its training do not differ in their light. Warns where
// they do and the file is missing. Throws UserError where the file is damaged.
std::optional<ExpectedLights> FindExpectedLights(const std::filesystem::path& foam_path,
                                                 const Model& model);

}  // namespace semfoam
