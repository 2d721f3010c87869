// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/exports.h"

#include "export/label_sidecar.h"
#include "export/names.h"
#include "foam/error.h"

#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

void SayWritten(const WrittenFile& file) { LOG(INFO) << "  " << file.path << ": " << file.summary; }

}  // namespace

void AddVolumeExportOptions(OptionManager* options, VolumeExportOptions* volume) {
  volume->creator = "semfoam " SEMFOAM_VERSION;
  options->AddDefaultOption("VolumeExport.voxel_size",
                            &volume->voxel_size,
                            "edge of a voxel in the COLMAP model's unit; 0 = by max_resolution");
  options->AddDefaultOption("VolumeExport.max_resolution",
                            &volume->max_resolution,
                            "voxels along the longest edge of the scene's box");
  options->AddDefaultOption("VolumeExport.min_optical_depth",
                            &volume->min_optical_depth,
                            "scene.vdb leaves out cells whose density times radius is below this");
  options->AddDefaultOption("VolumeExport.half_float",
                            &volume->half_float,
                            "save density, color and confidence with 16 bits");
  options->AddDefaultOption(
      "VolumeExport.int32_labels", &volume->int32_labels, "also write scene_labels_int32.vdb");
  options->AddDefaultOption("VolumeExport.max_voxels",
                            &volume->max_voxels,
                            "refuse to make more voxels than this (about 24 bytes of memory each)");
}

void AddMeshExportOptions(OptionManager* options, SurfaceExportOptions* surface) {
  options->AddDefaultOption(
      "MeshExport.om", &surface->om, "OpenMesh's own format: everything, lossless");
  options->AddDefaultOption(
      "MeshExport.ply", &surface->ply, "with label, confidence and colour on vertices and faces");
  options->AddDefaultOption("MeshExport.obj", &surface->obj, "with vertex colours");
}

void RequireValid(const VolumeExportOptions& volume) {
  if (const std::string wrong = volume.Check(); !wrong.empty()) {
    throw UserError("Failed to parse options - ", wrong);
  }
}

ExportableScene PrepareExport(const Model& model) {
  ExportableScene scene = MakeExportableScene(model);
  std::string left_out;
  for (const Label& label : scene.labels_without_cells) {
    left_out += (left_out.empty() ? "" : ", ") + DisplayName(label.id, label.name) + " (" +
                std::to_string(label.id) + ")";
  }
  if (!left_out.empty()) {
    LOG(INFO) << "Labels without solid cells, for which there will be no object: " << left_out;
  }
  return scene;
}

void WriteVolumes(const ExportableScene& scene,
                  const std::filesystem::path& output_path,
                  const VolumeExportOptions& volume) {
  LOG(INFO) << "Writing volumes";
  ExportVolumes(scene, output_path, volume, SayWritten);
}

void WriteMeshes(const ExportableScene& scene,
                 const std::filesystem::path& output_path,
                 const SurfaceExportOptions& surface) {
  LOG(INFO) << "Writing meshes";
  const std::vector<WrittenFile> files = ExportSurfaces(scene, output_path, surface);
  // The formats of one object hold the same surface: one line for all of them.
  for (size_t i = 0; i < files.size();) {
    WrittenFile line = files[i];
    for (++i; i < files.size() && files[i].object_id == line.object_id; ++i) {
      line.path += ", ." + files[i].format;
    }
    SayWritten(line);
  }
}

void WriteLabels(const ExportableScene& scene, const std::filesystem::path& output_path) {
  std::vector<WrittenFile> files;
  for (const ObjectInfo& object : scene.objects) {
    for (const char* format : {"vdb", "om", "ply", "obj"}) {
      const std::string path = "objects/" + object.file_stem + "." + format;
      if (std::filesystem::exists(output_path / path)) {
        files.push_back({object.id, format, path, ""});
      }
    }
  }
  WriteLabelSidecar(output_path / "labels.json", scene, files);
}

}  // namespace semfoam
