// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/surface_export.h"

#include "export/io/glb_file.h"
#include "export/io/local_mesh.h"
#include "export/io/mesh_files.h"
#include "export/io/usd_file.h"
#include "export/io/volume_fields.h"
#include "export/scene/object_selection.h"
#include "export/scene/object_surface.h"
#include "export/scene/surface_topology.h"
#include "export/surface/semantic_mesh.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_decimation.h"
#include "export/surface/surface_geometry.h"
#include "foam/util/error.h"

#include <algorithm>
#include <cstdio>
#include <optional>

#include <glog/logging.h>

namespace semfoam {
namespace {

// How far the surface is from the cells' one: in the files' unit and of the length of its diagonal.
std::string DistanceSummary(const ObjectSurface& surface, const ObjectSurface& cells) {
  const SurfaceDistance there =
      DistanceTo(surface.vertices, surface.triangles, cells.vertices, cells.triangles);
  const SurfaceDistance back =
      DistanceTo(cells.vertices, cells.triangles, surface.vertices, surface.triangles);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : surface.vertices) box.extend(vertex);
  const double percent = 100 / box.diagonal().norm();
  const double hausdorff = std::max(there.max, back.max);
  char text[200];
  std::snprintf(text,
                sizeof(text),
                ", from the cells %.3g in the mean (%.2g %% of the diagonal) and %.3g at most "
                "(%.2g %%), Hausdorff distance %.3g (%.2g %%)",
                there.mean,
                percent * there.mean,
                there.max,
                percent * there.max,
                hausdorff,
                percent * hausdorff);
  return text;
}

struct MadeSurface {
  ObjectSurface surface;
  std::string summary;
  std::string warning;
};

MadeSurface MakeSurface(const ExportableScene& scene,
                        const ObjectInfo& object,
                        const SurfaceExportOptions& options) {
  MadeSurface made;
  made.surface = ExtractSurface(scene, object);
  std::string faces, more;
  if (options.method == "smooth") {
    const ObjectSurface cells = std::move(made.surface);
    made.surface = ExtractSmoothSurface(scene, object, cells);
    if (const int64_t target = options.target_faces; target > 0) {
      made.surface = Decimate(made.surface, target);
      const Triangles& triangles = made.surface.triangles;
      if (const size_t crossing = SelfIntersections(made.surface.vertices, triangles).size();
          crossing > 0) {
        faces = ", " + std::to_string(crossing) + " of which intersect";
      }
      if (static_cast<int64_t>(triangles.size()) > target) {
        made.warning = std::to_string(triangles.size()) + " faces instead of " +
                       std::to_string(target) +
                       ", because fewer would tear the surface or fold it.";
      }
    }
    more = DistanceSummary(made.surface, cells);
  } else if (const int64_t far = CountFarVertices(scene, made.surface); far > 0) {
    more = ", " + std::to_string(far) + " vertices stick out into empty space";
  }
  const SurfaceTopology topology = TopologyOf(made.surface.vertices.size(), made.surface.triangles);
  made.summary = std::to_string(made.surface.vertices.size()) + " vertices, " +
                 std::to_string(made.surface.triangles.size()) + " faces" + faces + ", " +
                 TopologySummary(topology, object.pieces) + more;
  return made;
}

}  // namespace

std::string SurfaceExportOptions::Check() const {
  if (method != "cells" && method != "smooth") return "method must be cells or smooth.";
  if (target_faces != 0 && target_faces < 4) {
    return "target_faces must be at least 4, the faces of a tetrahedron, or 0 for all there are.";
  }
  if (target_faces != 0 && method != "smooth") {
    return "target_faces needs the method smooth; cells are exact and keep all their faces.";
  }
  return "";
}

std::vector<WrittenFile> ExportSurfaces(const ExportableScene& scene,
                                        const std::filesystem::path& output_path,
                                        const SurfaceExportOptions& options,
                                        const std::function<void(const WrittenFile&)>& on_written) {
  CHECK_EQ(options.Check(), "");
  std::vector<WrittenFile> files;
  const std::vector<const ObjectInfo*> objects = SelectObjects(scene, options.objects);
  if (objects.empty()) return files;
  const auto written = [&](int32_t id,
                           const std::string& path,
                           const std::string& summary,
                           const std::string& warning = {}) {
    files.push_back({id, path.substr(path.rfind('.') + 1), path, summary, warning});
    if (on_written) on_written(files.back());
  };
  GlbFile scene_glb(scene.transform, options.creator);
  std::optional<UsdFile> scene_usda;
  std::string usda_warning;
  if (options.usda)
    scene_usda.emplace(output_path / "scene.usda", scene.transform, options.creator);

  for (const ObjectInfo* const one : objects) {
    const ObjectInfo& object = *one;
    const MadeSurface made = MakeSurface(scene, object, options);
    const ObjectSurface& surface = made.surface;
    const std::string stem = "objects/" + object.file_stem;
    const auto write = [&](bool wanted, const char* extension, const auto& writer) {
      if (!wanted) return;
      writer(output_path / (stem + extension), surface);
      written(object.id, stem + extension, made.summary, made.warning);
    };
    write(options.om, ".om", WriteOm);
    write(options.ply, ".ply", WritePly);
    write(options.obj, ".obj", WriteObj);
    write(options.obj, ".mtl", WriteMtl);
    if (!options.glb && !options.usda) continue;

    const LocalMesh mesh = MakeLocalMesh(surface);
    write(options.glb, ".glb", [&](const std::filesystem::path& path, const auto&) {
      GlbFile glb(scene.transform, options.creator);
      glb.Add(object, surface, mesh);
      glb.Write(path);
    });
    if (options.glb) scene_glb.Add(object, surface, mesh);
    if (scene_usda) {
      std::vector<VolumeField> volume_fields;
      try {
        volume_fields = ReadVolumeFields(output_path / (stem + ".vdb"), options.source_checksum);
      } catch (const UserError& error) {
        // The surfaces are no worse for it.
        usda_warning += (usda_warning.empty() ? "does without " : " ") + std::string(error.what());
      }
      scene_usda->Add(object, surface, mesh, stem + ".vdb", volume_fields);
    }
  }
  const std::string summary =
      std::to_string(objects.size()) + (objects.size() == 1 ? " object" : " objects");
  if (options.glb) {
    scene_glb.Write(output_path / "scene.glb");
    written(0, "scene.glb", summary);
  }
  if (scene_usda) {
    scene_usda->Finish();
    written(0, "scene.usda", summary, usda_warning);
  }
  return files;
}

}  // namespace semfoam
