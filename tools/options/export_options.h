// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "tools/cli/option_manager.h"
#include "tools/controllers/export_format.h"
#include "tools/controllers/texture_source.h"

#include <set>
#include <string>

namespace semfoam {

// Adds --VolumeExport.*.
void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume);

// Adds --MeshExport.*.
void AddMeshExportOptions(OptionManager* options, SurfaceExportOptions* surface);

// Adds --MeshExport.crop, for commands without --VolumeExport.crop, which stands for both.
void AddMeshCropOption(OptionManager* options, SurfaceExportOptions* surface);

// Whether and how textures are baked.
struct TextureChoice {
  bool is_wanted = true;
  TextureFormat format = TextureFormat::kPng;
};

// Adds --texture, --texture_size and --texture_format.
void AddTextureOptions(OptionManager* options,
                       TextureChoice* choice,
                       SurfaceExportOptions* surface);

// Adds --formats. `*formats` lists the formats that the command can write; the default is all of
// them.
void AddFormatsOption(OptionManager* options, std::string* formats);
inline constexpr char kMeshFormats[] = "om,ply,obj,glb,usda";
inline constexpr char kAllFormats[] = "vdb,om,ply,obj,glb,usda";

// Adds --keep_largest, --min_cells and --keep_fragments.
void AddComponentOptions(OptionManager* options, ComponentOptions* components);

// Adds --labels and --exclude_labels.
void AddLabelOptions(OptionManager* options, LabelChoice* choice);
// Adds --VolumeExport.labels for --labels, the older spelling of commands that write volumes.
void AddVolumeLabelsName(OptionManager* options);

// Adds --labels_path for a command that exports.
void AddLabelNamesOption(OptionManager* options, std::string* labels_path);

// Throw UserError, naming the option, when an option is out of range. Must be called before any
// work.
void RequireValid(const VolumeExportOptions& volume);
void RequireValid(const ComponentOptions& components);
void RequireValid(const SurfaceExportOptions& surface);
// Throws UserError for an option of volumes or surfaces that the user gave but that has no effect
// because of another option. `formats` are those that the command writes.
void RequireEffects(const OptionManager& options,
                    const VolumeExportOptions& volume,
                    const LabelChoice& choice,
                    const std::set<ExportFormat>& formats);

// Parses a comma-separated list of formats, all of which must be in `allowed`.
std::set<ExportFormat> ParseFormats(const std::string& formats, const std::string& allowed);

}  // namespace semfoam
