// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/exports.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "tools/cli/memory_task.h"
#include "tools/cli/progress.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/object_photos.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <glog/logging.h>
#include <unistd.h>

namespace semfoam {
namespace {

// "3 pieces of 25 cells, volume 0.00123; the largest, of 20 cells, at (1, 2, 3)".
std::string Describe(const LeftOutPieces& left_out) {
  const auto plural = [](int64_t count, const char* noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
  };
  const Eigen::Vector3d& at = left_out.largest_center;
  std::ostringstream text;
  text << plural(left_out.pieces, "piece") << " of " << plural(left_out.cells, "cell")
       << ", volume " << left_out.volume << "; the largest, of "
       << plural(left_out.largest_cells, "cell") << ", at (" << std::setprecision(9) << at.x()
       << ", " << at.y() << ", " << at.z() << ")";
  return text.str();
}

void SayWritten(const WrittenFile& file) {
  LOG(INFO) << "  " << file.path << ": " << file.summary;
  if (!file.warning.empty()) LOG(WARNING) << file.path << ": " << file.warning;
}

// What a turn by multiples of 90 degrees leaves.
void SayTilt(const ExportTransform& transform) {
  constexpr double kLevelDegrees = 5;
  if (transform.up_axis == "colmap") return;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "--up_axis " << transform.up_axis
       << " leaves the photos' mean upward direction " << transform.up_tilt_degrees
       << " degrees off that axis";
  if (transform.up_tilt_degrees < kLevelDegrees) {
    LOG(INFO) << text.str();
  } else {
    LOG(WARNING) << text.str()
                 << ", because it turns by multiples of 90 degrees; level the model with `colmap "
                    "model_orientation_aligner`, or give the rotation with --transform.";
  }
}

}  // namespace

void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume) {
  volume->creator = "semfoam " SEMFOAM_VERSION;
  options->AddDefaultOption("VolumeExport.voxel_size",
                            &volume->voxel_size,
                            "edge of a voxel in the files' unit; 0 = by max_resolution");
  options->AddDefaultOption("VolumeExport.max_resolution",
                            &volume->max_resolution,
                            "voxels along the longest edge of the scene's box");
  options->AddDefaultOption(
      "VolumeExport.crop",
      &volume->crop,
      "x0,y0,z0,x1,y1,z1 in the COLMAP model's frame: no voxel outside of it");
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
  options->AddChoiceOption("VolumeExport.label_grid_type",
                           &volume->label_grid_type,
                           {"float", "int32", "both"},
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
  options->AddChoiceOption("MeshExport.method",
                           &surface->method,
                           {"cells", "smooth"},
                           "cells = the exact faces of the cells; smooth = an iso-surface through "
                           "them, smoothed, with the same volume");
  options->AddDefaultOption("MeshExport.target_faces",
                            &surface->target_faces,
                            "smooth only: at most so many triangles for each object; 0 = all");
}

void AddMeshShortNames(OptionManager* options) {
  for (const char* name : {"method", "target_faces"}) {
    options->AddShortName(name, std::string("MeshExport.") + name);
  }
}

void AddFormatsOption(OptionManager* options, std::string* formats) {
  options->AddDefaultOption("formats", formats, "what to write, apart by commas");
}

void AddFrameOptions(OptionManager* options, ExportTransformOptions* frame) {
  options->AddDefaultOption("transform",
                            &frame->transform,
                            "a similarity from the COLMAP frame to that of the files: the 12 or 16 "
                            "numbers of its matrix, row by row");
  options->AddChoiceOption("up_axis",
                           &frame->up_axis,
                           {"colmap", "y", "z"},
                           "then a turn, by a multiple of 90 degrees, of what is up in the photos "
                           "onto this axis; colmap = none");
  options->AddDefaultOption("scale", &frame->scale, "then so many times as large");
  options->AddChoiceOption("units",
                           &frame->units,
                           LengthUnits(),
                           "what one unit of the files is then; changes no number");
}

void AddPieceOptions(OptionManager* options, PieceOptions* pieces) {
  options->AddDefaultOption("keep_largest",
                            &pieces->keep_largest,
                            "of each object's connected pieces the largest so many alone, by "
                            "volume; 0 = all");
  options->AddDefaultOption("min_cells",
                            &pieces->min_cells,
                            "no pieces with fewer cells; 0 = none with fewer than a tenth of those "
                            "of the object's largest, and no fragments");
  options->AddDefaultOption("keep_fragments",
                            &pieces->keep_fragments,
                            "also objects of a few cells that look like a tracker's mistakes");
}

void RequireValid(const PieceOptions& pieces) {
  const auto require = [](const char* name, int64_t value) {
    if (value >= 0) return;
    throw UserError("Failed to parse options - the argument ('",
                    value,
                    "') for option '--",
                    name,
                    "' is invalid; it takes a number from 0 on.");
  };
  require("keep_largest", pieces.keep_largest);
  require("min_cells", pieces.min_cells);
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
                    const std::set<std::string>& formats) {
  const auto require = [&](const std::string& group, bool is_written, const std::string& named) {
    if (is_written) return;
    std::vector<std::string> names;
    for (const auto& [name, value] : options.GroupValues(group)) {
      names.push_back(group);
      names.back().append(".").append(name);
    }
    options.RequireEffect(names,
                          "without " + named + " among the --formats; add it, or leave this out");
  };
  require("VolumeExport", formats.count("vdb") != 0, "vdb");
  require("MeshExport", formats != std::set<std::string>{"vdb"}, "a mesh's format");
  if (volume.voxel_size > 0) {
    options.RequireEffect({"VolumeExport.max_resolution"},
                          "with --VolumeExport.voxel_size; give one of the two");
  }
  if (!choice.labels.empty()) {
    options.RequireEffect({"VolumeExport.min_optical_depth"},
                          "with --labels, whose cells are all written; give one of the two");
  }
}

std::set<std::string> ParseFormats(const std::string& formats, const std::string& allowed) {
  const std::vector<std::string> known = SplitAtCommas(allowed);
  std::set<std::string> parsed;
  for (const std::string& format : SplitAtCommas(formats)) {
    if (std::find(known.begin(), known.end(), format) == known.end()) {
      throw UserError("Failed to parse options - the argument ('",
                      formats,
                      "') for option '--formats' is invalid; it takes any of ",
                      allowed,
                      ", apart by commas.");
    }
    parsed.insert(format);
  }
  return parsed;
}

void RequireOneFrame(const ExportTransform& transform,
                     const std::filesystem::path& output_path,
                     const std::set<std::string>& formats,
                     const std::string& foam_checksum) {
  const std::optional<ExportRecord> record = ReadExportRecord(output_path);
  if (!record || IsInFrame(*record, transform)) return;
  // Those of another foam go.
  if (!record->foam_checksum.empty() && record->foam_checksum != foam_checksum) return;
  for (const ExportRecord::File& file : record->files) {
    const std::string writer = file.format == "mtl" ? "obj" : file.format;
    if (formats.count(writer) != 0) continue;
    throw UserError((output_path / file.path).string(),
                    ": is in another frame than this export and would stay; choose another "
                    "--output_path, or the --transform, --up_axis, --scale and --units that "
                    "labels.json there tells of.");
  }
}

void AddVolumeShortNames(OptionManager* options) {
  for (const char* name : {"voxel_size", "max_resolution", "crop", "supersample"}) {
    options->AddShortName(name, std::string("VolumeExport.") + name);
  }
}

std::string ModelChecksum(const std::filesystem::path& foam_path) {
  uint64_t checksum = 0;
  std::ifstream file(foam_path, std::ios::binary);
  file.seekg(-static_cast<std::streamoff>(sizeof(checksum)), std::ios::end);
  file.read(reinterpret_cast<char*>(&checksum), sizeof(checksum));
  if (!file) throw UserError(foam_path.string(), ": cannot be read.");
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(checksum));
  return text;
}

ExportableScene PrepareExport(const Model& model,
                              const std::filesystem::path& foam_path,
                              ExportTransform transform,
                              const PieceOptions& pieces) {
  TurnUpright(model.photos, &transform);
  SayTilt(transform);
  ExportableSceneOptions options;
  options.transform = transform;
  options.pieces = pieces;
  ExportableScene scene = MakeExportableScene(model, options);
  FindPhotosOfObjects(model, foam_path, &scene);
  for (const ObjectInfo& object : scene.objects) {
    if (object.left_out.pieces == 0) continue;
    LOG(INFO) << "Left out of " << object.name << " (" << object.id
              << "): " << Describe(object.left_out);
  }
  for (const LeftOutLabel& label : scene.labels_left_out) {
    LOG(INFO) << "No object " << label.name << " (" << label.id << "), " << label.reason << ": "
              << Describe(label.pieces)
              << (label.is_fragment ? "; --keep_fragments 1 keeps it" : "");
  }
  std::string without_cells;
  for (const Label& label : scene.labels_without_cells) {
    without_cells += (without_cells.empty() ? "" : ", ") + DisplayName(label.id, label.name) +
                     " (" + std::to_string(label.id) + ")";
  }
  if (!without_cells.empty()) {
    LOG(INFO) << "Labels without solid cells, for which there will be no object: " << without_cells;
  }
  return scene;
}

void RequireObjects(const ExportableScene& scene, const std::filesystem::path& foam_path) {
  if (!scene.objects.empty()) return;
  if (!scene.labels_left_out.empty()) {
    throw UserError(foam_path.string(),
                    ": all pieces of its objects are left out, so there is no surface to write; a "
                    "smaller --min_cells would be right.");
  }
  if (!scene.labels_without_cells.empty()) {
    throw UserError(foam_path.string(),
                    ": none of its ",
                    scene.labels_without_cells.size(),
                    " labels has solid cells, so there is no surface to write; a longer training "
                    "would be right, or volume_exporter, which writes the whole scene.");
  }
  throw UserError(foam_path.string(),
                  ": has no labels, so there is no object whose surface could be written; a "
                  "training with masks would be right, or volume_exporter, which writes the whole "
                  "scene.");
}

std::vector<WrittenFile> WriteVolumes(const ExportableScene& scene,
                                      const std::filesystem::path& output_path,
                                      const VolumeExportOptions& volume) {
  const MemoryTask task("volumes are made",
                        "a larger --VolumeExport.voxel_size or a smaller "
                        "--VolumeExport.max_resolution");
  LOG(INFO) << "Writing volumes";
  ProgressLine line(std::cerr, ::isatty(STDERR_FILENO) != 0);
  const auto begin = std::chrono::steady_clock::now();
  return ExportVolumes(
      scene,
      output_path,
      volume,
      [&](const WrittenFile& file) {
        line.Clear();
        SayWritten(file);
      },
      [&](const VolumeProgress& progress) {
        const std::chrono::duration<double> since = std::chrono::steady_clock::now() - begin;
        line.Show("  volume " + std::to_string(progress.file) + " of " +
                      std::to_string(progress.num_files) + ", " + progress.path + ": " +
                      std::to_string(std::lround(100 * progress.share)) + " %",
                  since.count());
      });
}

std::vector<WrittenFile> WriteMeshes(const ExportableScene& scene,
                                     const std::filesystem::path& output_path,
                                     const std::set<std::string>& formats,
                                     SurfaceExportOptions surface) {
  if (scene.objects.empty()) {
    LOG(WARNING) << "There is no object, so no meshes are written.";
    return {};
  }
  const MemoryTask task("meshes are made", "a foam of fewer objects (object_extractor)");
  surface.om = formats.count("om") != 0;
  surface.ply = formats.count("ply") != 0;
  surface.obj = formats.count("obj") != 0;
  surface.glb = formats.count("glb") != 0;
  surface.usda = formats.count("usda") != 0;
  surface.creator = "semfoam " SEMFOAM_VERSION;
  LOG(INFO) << "Writing meshes";
  std::vector<WrittenFile> files = ExportSurfaces(scene, output_path, surface);
  // The formats of one object hold the same surface: one line for all of them.
  for (size_t i = 0; i < files.size();) {
    WrittenFile line = files[i];
    for (++i; i < files.size() && files[i].object_id == line.object_id; ++i) {
      line.path += ", ." + files[i].format;
    }
    SayWritten(line);
  }
  return files;
}

}  // namespace semfoam
