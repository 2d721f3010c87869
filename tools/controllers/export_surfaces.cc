// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_surfaces.h"

#include "export/blocks/block_export.h"
#include "tools/controllers/written_files.h"
#include "tools/support/memory_task.h"

#include <utility>

#include <glog/logging.h>

namespace semfoam {

namespace {

SurfaceExportOptions WithFormats(SurfaceExportOptions surface,
                                 const std::set<ExportFormat>& formats) {
  surface.om = formats.count(ExportFormat::kOm) != 0;
  surface.ply = formats.count(ExportFormat::kPly) != 0;
  surface.obj = formats.count(ExportFormat::kObj) != 0;
  surface.glb = formats.count(ExportFormat::kGlb) != 0;
  surface.usda = formats.count(ExportFormat::kUsda) != 0;
  surface.creator = "semfoam " SEMFOAM_VERSION;
  return surface;
}

// The formats of one object hold the same surface: one line for all of them.
void LogTogether(const std::vector<WrittenFile>& files) {
  for (size_t i = 0; i < files.size();) {
    WrittenFile line = files[i];
    for (++i; i < files.size() && files[i].object_id == line.object_id; ++i) {
      line.path += ", ." + files[i].format;
    }
    LogWritten(line);
  }
}

}  // namespace

std::vector<WrittenFile> WriteMeshes(const ExportableScene& scene,
                                     const std::filesystem::path& output_path,
                                     const std::set<ExportFormat>& formats,
                                     SurfaceExportOptions surface) {
  if (scene.objects.empty()) {
    LOG(WARNING) << "There is no object, so no meshes are written.";
    return {};
  }
  const MemoryTask task("meshes are made", "a foam of fewer objects (object_extractor)");
  LOG(INFO) << "Writing meshes";
  const std::vector<WrittenFile> files =
      ExportSurfaces(scene, output_path, WithFormats(std::move(surface), formats));
  LogTogether(files);
  return files;
}

std::vector<WrittenFile> WriteBlockMeshes(BlockScenes* scenes,
                                          ExportableScene* objects,
                                          const std::filesystem::path& output_path,
                                          const std::set<ExportFormat>& formats,
                                          SurfaceExportOptions surface) {
  const MemoryTask task("meshes are made", "more blocks (scene_splitter)");
  LOG(INFO) << "Writing meshes, block by block";
  surface.method = SurfaceMethod::kCells;
  const std::vector<WrittenFile> files =
      ExportBlockSurfaces(scenes, objects, output_path, WithFormats(std::move(surface), formats));
  LogTogether(files);
  return files;
}

std::vector<WrittenFile> WriteWholeMesh(const ExportableScene& scene,
                                        const std::filesystem::path& output_path,
                                        const std::set<ExportFormat>& formats,
                                        SurfaceExportOptions surface) {
  const MemoryTask task("the mesh is made", "a foam of fewer cells");
  LOG(INFO) << "Writing the scene as one mesh, for there are no labels";
  const std::vector<WrittenFile> files =
      ExportWholeSurface(scene, output_path, WithFormats(std::move(surface), formats));
  if (files.empty()) LOG(WARNING) << "Nothing is solid, so no mesh is written.";
  LogTogether(files);
  return files;
}

}  // namespace semfoam
