// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/exports.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/object_photos.h"
#include "tools/support/memory_task.h"
#include "tools/support/progress.h"

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
  text << std::fixed << std::setprecision(1) << "up_axis " << transform.up_axis
       << " leaves the photos' mean upward direction " << transform.up_tilt_degrees
       << " degrees off that axis";
  if (transform.up_tilt_degrees < kLevelDegrees) {
    LOG(INFO) << text.str();
  } else {
    LOG(WARNING) << text.str()
                 << ", because it turns by multiples of 90 degrees; level the model with `colmap "
                    "model_orientation_aligner`, or give the rotation with transform.";
  }
}

}  // namespace

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
                    "output_path, or the transform, up_axis, scale and units that "
                    "labels.json there tells of.");
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
              << Describe(label.pieces) << (label.is_fragment ? "; keep_fragments keeps it" : "");
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
                    "smaller min_cells would be right.");
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
                                      VolumeExportOptions volume) {
  const MemoryTask task("volumes are made", "a larger voxel_size or a smaller max_resolution");
  LOG(INFO) << "Writing volumes";
  ProgressLine line(std::cerr, ::isatty(STDERR_FILENO) != 0);
  const auto begin = std::chrono::steady_clock::now();
  volume.creator = "semfoam " SEMFOAM_VERSION;
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
