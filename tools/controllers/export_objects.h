// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/frame_choice.h"
#include "foam/model/model.h"

#include <filesystem>

namespace semfoam {

// Finds the objects of a model, for all commands that export or list them.

// Finds the model's objects and the photos that show them. Logs which parts of the objects are left
// out, which labels have no object, and how the frame was levelled. `foam_path` is the file of the
// model; `frame` is completed with FindFrame. Throws as that does.
ExportableScene PrepareExport(const Model& model,
                              const std::filesystem::path& foam_path,
                              const FrameChoice& frame = {},
                              const ComponentOptions& components = {});

// Whether the model has no labels, so that its surface is written as a whole (PrepareWhole).
bool IsWhole(const Model& model);

// Prepares the whole scene as one object (MakeWholeScene), for a model without labels, with the
// transform of PrepareExport's result.
ExportableScene PrepareWhole(const Model& model,
                             const ExportTransform& transform,
                             const ComponentOptions& components);

// Throws UserError, with the reason, where the scene of `foam_path` has no object, for a command
// that writes only objects. Must be called before anything is written.
void RequireObjects(const ExportableScene& scene, const std::filesystem::path& foam_path);

}  // namespace semfoam
