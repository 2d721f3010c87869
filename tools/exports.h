// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"
#include "export/surface_export.h"
#include "export/volume_export.h"
#include "foam/model.h"
#include "tools/option_manager.h"

#include <filesystem>

namespace semfoam {

// Adds --VolumeExport.* and --MeshExport.*.
void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume);
void AddMeshExportOptions(OptionManager* options, SurfaceExportOptions* surface);

// Throws UserError, in the words of the option manager, when an option is out of range. To be
// called before any work.
void RequireValid(const VolumeExportOptions& volume);

// Finds the model's objects, and says which labels have none because no cell of theirs is solid.
ExportableScene PrepareExport(const Model& model);

// Write the files and say what was written.
void WriteVolumes(const ExportableScene& scene,
                  const std::filesystem::path& output_path,
                  const VolumeExportOptions& volume);
void WriteMeshes(const ExportableScene& scene,
                 const std::filesystem::path& output_path,
                 const SurfaceExportOptions& surface);

// Writes labels.json; every object's "files" are those that lie under their names in `output_path`.
void WriteLabels(const ExportableScene& scene, const std::filesystem::path& output_path);

}  // namespace semfoam
