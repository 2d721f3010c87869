// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// The checksum at the end of a model's file (WriteModel), as VolumeExportOptions::source_checksum
// has it. Throws UserError when it cannot be read.
std::string ModelChecksum(const std::filesystem::path& foam_path);

// Throws UserError when `output_path` holds exports of this foam in another frame of which
// `formats` would not replace all: labels.json could not be true of both. What is there of another
// foam goes (WriteLabels in export_record.h).
void RequireOneFrame(const ExportTransform& transform,
                     const std::filesystem::path& output_path,
                     const std::set<std::string>& formats,
                     const std::string& foam_checksum);

// Finds the model's objects and the photos that show them, and says what is left out of them, and
// which labels have none. Turns `transform` upright where it asks for that. `foam_path` is where
// the model is.
ExportableScene PrepareExport(const Model& model,
                              const std::filesystem::path& foam_path,
                              ExportTransform transform = {},
                              const PieceOptions& pieces = {});

// Throws UserError when the scene of `foam_path` has no object, saying why: for a command that
// writes objects and nothing else. To be called before anything is written.
void RequireObjects(const ExportableScene& scene, const std::filesystem::path& foam_path);

// Write the files, say what was written, and return it. `surface` says all but the formats.
std::vector<WrittenFile> WriteVolumes(const ExportableScene& scene,
                                      const std::filesystem::path& output_path,
                                      VolumeExportOptions volume);
std::vector<WrittenFile> WriteMeshes(const ExportableScene& scene,
                                     const std::filesystem::path& output_path,
                                     const std::set<std::string>& formats,
                                     SurfaceExportOptions surface = {});

}  // namespace semfoam
