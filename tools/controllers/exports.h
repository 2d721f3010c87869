// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "foam/model/model.h"
#include "tools/cli/option_manager.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// Adds --VolumeExport.*.
void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume);

// Adds --MeshExport.*.
void AddMeshExportOptions(OptionManager* options, SurfaceExportOptions* surface);

// Adds --formats. `*formats` lists what the command can write, all of which is the default.
void AddFormatsOption(OptionManager* options, std::string* formats);
inline constexpr char kMeshFormats[] = "om,ply,obj,glb,usda";
inline constexpr char kAllFormats[] = "vdb,om,ply,obj,glb,usda";

// Adds --up_axis, --scale, --transform, --units; ParseExportTransform reads them.
void AddFrameOptions(OptionManager* options, ExportTransformOptions* frame);

// Adds --keep_largest, --min_cells and --keep_fragments.
void AddPieceOptions(OptionManager* options, PieceOptions* pieces);

// --voxel_size for --VolumeExport.voxel_size, and so on: for a command that makes volumes and
// nothing else.
void AddVolumeShortNames(OptionManager* options);
// --method and --target_faces, likewise.
void AddMeshShortNames(OptionManager* options);

// The checksum at the end of a model's file (WriteModel), as VolumeExportOptions::source_checksum
// has it. Throws UserError when it cannot be read.
std::string ModelChecksum(const std::filesystem::path& foam_path);

// These throw UserError, in the words of the option manager, when an option is out of range. To be
// called before any work.
void RequireValid(const VolumeExportOptions& volume);
void RequireValid(const PieceOptions& pieces);
void RequireValid(const SurfaceExportOptions& surface);
// Throws UserError for an option of volumes or surfaces that the user gave and another one leaves
// without effect. `formats` are those that the command writes.
void RequireEffects(const OptionManager& options,
                    const VolumeExportOptions& volume,
                    const LabelChoice& choice,
                    const std::set<std::string>& formats);

// The formats of a comma list, each of which `allowed` must have.
std::set<std::string> ParseFormats(const std::string& formats, const std::string& allowed);

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
                                      const VolumeExportOptions& volume);
std::vector<WrittenFile> WriteMeshes(const ExportableScene& scene,
                                     const std::filesystem::path& output_path,
                                     const std::set<std::string>& formats,
                                     SurfaceExportOptions surface = {});

}  // namespace semfoam
