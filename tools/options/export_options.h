// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "tools/cli/option_manager.h"
#include "tools/controllers/export_format.h"

#include <set>
#include <string>

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
void AddComponentOptions(OptionManager* options, ComponentOptions* components);

// --voxel_size for --VolumeExport.voxel_size, and so on: for a command that makes volumes and
// nothing else.
void AddVolumeShortNames(OptionManager* options);
// --method and --target_faces, likewise.
void AddMeshShortNames(OptionManager* options);

// Adds --labels and --exclude_labels.
void AddLabelOptions(OptionManager* options, LabelChoice* choice);
// --VolumeExport.labels for --labels, as commands that write volumes have always spelled it.
void AddVolumeLabelsName(OptionManager* options);

// Adds --labels_path for a command that exports.
void AddLabelNamesOption(OptionManager* options, std::string* labels_path);

// These throw UserError, in the words of the option manager, when an option is out of range. To be
// called before any work.
void RequireValid(const VolumeExportOptions& volume);
void RequireValid(const ComponentOptions& components);
void RequireValid(const SurfaceExportOptions& surface);
// Throws UserError for an option of volumes or surfaces that the user gave and another one leaves
// without effect. `formats` are those that the command writes.
void RequireEffects(const OptionManager& options,
                    const VolumeExportOptions& volume,
                    const LabelChoice& choice,
                    const std::set<ExportFormat>& formats);

// The formats of a comma list, each of which `allowed` must have.
std::set<ExportFormat> ParseFormats(const std::string& formats, const std::string& allowed);

}  // namespace semfoam
