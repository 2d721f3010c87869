// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"
#include "export/surface_export.h"
#include "export/volume_export.h"
#include "foam/model.h"
#include "tools/option_manager.h"

#include <filesystem>
#include <string>

namespace semfoam {

// Adds --VolumeExport.* and --MeshExport.*.
void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume);
void AddMeshExportOptions(OptionManager* options, SurfaceExportOptions* surface);

// --voxel_size for --VolumeExport.voxel_size, and so on: for a command that makes volumes and
// nothing else.
void AddVolumeShortNames(OptionManager* options);

// The checksum at the end of a model's file (WriteModel), as VolumeExportOptions::source_checksum
// has it. Throws UserError when it cannot be read.
std::string ModelChecksum(const std::filesystem::path& foam_path);

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
