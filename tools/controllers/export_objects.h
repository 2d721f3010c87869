// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <filesystem>

namespace semfoam {

// The objects of a model, as all commands that export or list them find them.

// Finds the model's objects and the photos that show them. Logs what is left out of the objects,
// which labels have no object, and by how much an up axis is off. `foam_path` is where the model
// is; `transform` is turned upright where it asks for that. Throws FieldError where the photos do
// not tell what is up (TurnUpright).
ExportableScene PrepareExport(const Model& model,
                              const std::filesystem::path& foam_path,
                              ExportTransform transform = {},
                              const ComponentOptions& components = {});

// Throws UserError where the scene of `foam_path` has no object, saying why: for a command that
// writes objects and nothing else. To be called before anything is written.
void RequireObjects(const ExportableScene& scene, const std::filesystem::path& foam_path);

}  // namespace semfoam
