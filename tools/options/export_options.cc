// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/export_options.h"

#include "foam/util/error.h"
#include "tools/options/enum_option.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace semfoam {

void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume) {
  options->AddDefaultOption("VolumeExport.voxel_size",
                            &volume->voxel_size,
                            "edge of a voxel in the files' unit; 0 = by max_resolution");
  options->AddDefaultOption("VolumeExport.max_resolution",
                            &volume->max_resolution,
                            "voxels along the longest edge of the scene's box");
  options->AddDefaultOption("VolumeExport.crop",
                            &volume->crop,
                            "x0,y0,z0,x1,y1,z1 in the COLMAP model's frame: no voxel outside of "
                            "it, and meshes cut there");
  options->AddDefaultOption("VolumeExport.supersample",
                            &volume->supersample,
                            "samples along each edge of a voxel, 1 to 8; 1 = its centre alone");
  options->AddDefaultOption("VolumeExport.min_optical_depth",
                            &volume->min_optical_depth,
                            "scene.vdb leaves out cells whose density times radius is below this");
  const auto add_name = [&](const std::string& grid, std::string* name) {
    options->AddDefaultOption(
        "VolumeExport." + grid + "_grid_name", name, "what the grid is called in the files");
  };
  add_name("density", &volume->grid_names.density);
  add_name("color", &volume->grid_names.color);
  add_name("label", &volume->grid_names.label);
  add_name("confidence", &volume->grid_names.confidence);
  add_name("surface", &volume->grid_names.surface);
  AddEnumOption(options,
                "VolumeExport.label_grid_type",
                &volume->label_grid_type,
                kLabelGridTypeNames,
                "int32 labels stand in scene_labels_int32.vdb");
  options->AddDefaultOption("VolumeExport.half_float",
                            &volume->half_float,
                            "save density, color and confidence with 16 bits");
  options->AddDefaultOption(
      "VolumeExport.nvdb", &volume->nvdb, "also a NanoVDB file beside each volume");
  options->AddDefaultOption("VolumeExport.points",
                            &volume->points,
                            "also scene_points.vdb: every solid cell as a point with attributes");
  options->AddDefaultOption("VolumeExport.max_voxels",
                            &volume->max_voxels,
                            "refuse to make more voxels than this (about 24 bytes of memory each)");
}

void AddMeshExportOptions(OptionManager* options, SurfaceExportOptions* surface) {
  AddEnumOption(options,
                "MeshExport.method",
                &surface->method,
                kSurfaceMethodNames,
                "smooth = an iso-surface through the cells, smoothed, with the same volume; cells "
                "= their exact faces");
  options->AddDefaultOption("MeshExport.target_faces",
                            &surface->target_faces,
                            "smooth only: at most so many triangles for each object; 0 = all");
  options->AddDefaultOption(
      "MeshExport.close_sheets",
      &surface->close_sheets,
      "smooth only: close walls, floors and scenes without labels by the back "
      "that no photo shows, too, instead of leaving them sheets with a rim");
}

void AddMeshCropOption(OptionManager* options, SurfaceExportOptions* surface) {
  options->AddDefaultOption("MeshExport.crop",
                            &surface->crop,
                            "x0,y0,z0,x1,y1,z1 in the COLMAP model's frame to cut surfaces at; by "
                            "default those that reach far beyond what photos show");
}

void AddTextureOptions(OptionManager* options,
                       TextureChoice* choice,
                       SurfaceExportOptions* surface) {
  options->AddDefaultOption(
      "texture", &choice->is_wanted, "also textures, baked from the photos, in obj, glb and usda");
  options->AddDefaultOption("texture_size",
                            &surface->texture.size,
                            "edge of a texture in texels, at most; smaller where the photos do not "
                            "show more");
  AddEnumOption(options,
                "texture_format",
                &choice->format,
                kTextureFormatNames,
                "jpeg is about a fifth as large");
}

void AddFormatsOption(OptionManager* options, std::string* formats) {
  options->AddDefaultOption("formats", formats, "what to write, apart by commas");
}

void AddComponentOptions(OptionManager* options, ComponentOptions* components) {
  options->AddDefaultOption("keep_largest",
                            &components->keep_largest,
                            "of each object's connected components the largest so many alone, by "
                            "volume; 0 = all");
  options->AddDefaultOption(
      "min_cells",
      &components->min_cells,
      "no components with fewer cells; 0 = none with fewer than a tenth of those "
      "of the object's largest, and no fragments");
  options->AddDefaultOption("keep_fragments",
                            &components->keep_fragments,
                            "also objects of a few cells that look like a tracker's mistakes");
}

void RequireValid(const ComponentOptions& components) {
  const auto require = [](const char* name, int64_t value) {
    if (value >= 0) return;
    throw UserError("Failed to parse options - the argument ('",
                    value,
                    "') for option '--",
                    name,
                    "' is invalid; it takes a number from 0 on.");
  };
  require("keep_largest", components.keep_largest);
  require("min_cells", components.min_cells);
}

void RequireValid(const VolumeExportOptions& volume) {
  if (const std::string wrong = volume.Check(); !wrong.empty()) {
    throw UserError("Failed to parse options - ", wrong);
  }
}

void RequireValid(const SurfaceExportOptions& surface) {
  if (const std::string wrong = surface.Check(); !wrong.empty()) {
    throw UserError("Failed to parse options - ", wrong);
  }
}

void RequireEffects(const OptionManager& options,
                    const VolumeExportOptions& volume,
                    const LabelChoice& choice,
                    const std::set<ExportFormat>& formats) {
  const auto require = [&](const std::string& group, bool is_written, const std::string& named) {
    if (is_written) return;
    std::vector<std::string> names;
    for (const auto& [name, value] : options.GroupValues(group)) {
      if (name == "crop") continue;  // cuts meshes, too
      names.push_back(group);
      names.back().append(".").append(name);
    }
    options.RequireEffect(names,
                          "without " + named + " among the --formats; add it, or leave this out");
  };
  require("VolumeExport", formats.count(ExportFormat::kVdb) != 0, "vdb");
  require("MeshExport", formats != std::set<ExportFormat>{ExportFormat::kVdb}, "a mesh's format");
  // volume_exporter writes no meshes and has none of these.
  if (options.Has("texture") && !TakesTextures(formats)) {
    options.RequireEffect(
        {"texture", "texture_size", "texture_format"},
        "without obj, glb or usda among the --formats; add one, or leave this out");
  }
  if (volume.voxel_size > 0) {
    options.RequireEffect({"VolumeExport.max_resolution"},
                          "with --VolumeExport.voxel_size; give one of the two");
  }
  if (!choice.labels.empty()) {
    options.RequireEffect({"VolumeExport.min_optical_depth"},
                          "with --labels, whose cells are all written; give one of the two");
  }
}

std::set<ExportFormat> ParseFormats(const std::string& formats, const std::string& allowed) {
  const std::vector<std::string> known = SplitAtCommas(allowed);
  std::set<ExportFormat> parsed;
  for (const std::string& format : SplitAtCommas(formats)) {
    const std::optional<ExportFormat> value = ParseEnum(kExportFormatNames, format);
    if (!value || std::find(known.begin(), known.end(), format) == known.end()) {
      throw UserError("Failed to parse options - the argument ('",
                      formats,
                      "') for option '--formats' is invalid; it takes any of ",
                      allowed,
                      ", apart by commas.");
    }
    parsed.insert(*value);
  }
  return parsed;
}

void AddLabelOptions(OptionManager* options, LabelChoice* choice) {
  options->AddDefaultOption("labels",
                            &choice->labels,
                            "these objects alone: ids, names or classes, apart by commas, as "
                            "mug,7,chair; id:7, name:7 and class:chair where a text is more than "
                            "one of these");
  options->AddDefaultOption("exclude_labels",
                            &choice->exclude_labels,
                            "all objects but these, or of --labels all but these");
}

void AddVolumeLabelsName(OptionManager* options) {
  options->AddShortName("VolumeExport.labels", "labels");
}

void AddLabelNamesOption(OptionManager* options, std::string* labels_path) {
  options->AddDefaultOption("labels_path",
                            labels_path,
                            "names of the labels, {\"labels\": {\"7\": \"mug\"}}; by default those "
                            "changed in the labels.json of --output_path or beside the foam, then "
                            "the foam's own");
}

}  // namespace semfoam
