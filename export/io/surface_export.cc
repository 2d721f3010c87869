// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/surface_export.h"

#include "export/io/glb_file.h"
#include "export/io/local_mesh.h"
#include "export/io/made_surfaces.h"
#include "export/io/mesh_files.h"
#include "export/io/usd_file.h"
#include "export/io/volume_fields.h"
#include "export/scene/object_components.h"
#include "export/scene/object_selection.h"
#include "export/scene/object_surface.h"
#include "export/scene/surface_topology.h"
#include "export/surface/boundary_cut.h"
#include "export/surface/clean_cells.h"
#include "export/surface/contact_planes.h"
#include "export/surface/open_sheet.h"
#include "export/surface/semantic_mesh.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_box.h"
#include "export/surface/surface_decimation.h"
#include "export/surface/surface_geometry.h"
#include "export/texture/texture_baker.h"
#include "export/volume/volume_options.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <algorithm>
#include <cstdio>
#include <optional>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Returns a text with the distance of the surface from the cells' one, in the files' unit and as a
// share of its diagonal. A sheet has no Hausdorff distance: the cells' surface has a back, too.
std::string DistanceSummary(const ObjectSurface& surface,
                            const ObjectSurface& cells,
                            bool is_sheet) {
  const SurfaceDistance there =
      DistanceTo(surface.vertices, surface.triangles, cells.vertices, cells.triangles);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : surface.vertices) box.extend(vertex);
  const double percent = 100 / box.diagonal().norm();
  char text[200];
  const int length = std::snprintf(
      text,
      sizeof(text),
      ", from the cells %.3g in the mean (%.2g %% of the diagonal) and %.3g at most (%.2g %%)",
      there.mean,
      percent * there.mean,
      there.max,
      percent * there.max);
  if (!is_sheet) {
    const SurfaceDistance back =
        DistanceTo(cells.vertices, cells.triangles, surface.vertices, surface.triangles);
    const double hausdorff = std::max(there.max, back.max);
    std::snprintf(text + length,
                  sizeof(text) - length,
                  ", Hausdorff distance %.3g (%.2g %%)",
                  hausdorff,
                  percent * hausdorff);
  }
  return text;
}

// Normalised frame.
Eigen::AlignedBox3d BoxOf(const ExportableScene& scene,
                          const ObjectInfo& object,
                          const SurfaceExportOptions& options) {
  if (const std::optional<Eigen::AlignedBox3d> crop = ParseCrop(options.crop)) {
    return {scene.colmap_from_normalized.Invert(crop->min()),
            scene.colmap_from_normalized.Invert(crop->max())};
  }
  return options.method == SurfaceMethod::kSmooth ? SurfaceBox(scene, object.cells) : WholeSpace();
}

// ", 3 pits filled"; nothing for none.
std::string Counted(int64_t count, const std::string& noun, const std::string& verb) {
  if (count == 0) return "";
  return ", " + std::to_string(count) + " " + noun + (count == 1 ? " " : "s ") + verb;
}

// The visible side of a whole scene, of walls and of floors; nothing for bodies, and where it is
// not known what photos show.
std::optional<ObjectSurface> SheetOf(const ObjectInfo& object,
                                     const ObjectSurface& surface,
                                     bool is_cut,
                                     const SurfaceExportOptions& options) {
  if (options.close_sheets || (object.id != kNoObject && !IsSheet(surface, is_cut))) {
    return std::nullopt;
  }
  ObjectSurface sheet = OpenSheet(surface);
  return sheet.triangles.empty() ? std::nullopt : std::optional(std::move(sheet));
}

// ", texture of 1024 x 1024 ...".
std::string TextureSummary(const SurfaceTexture& texture) {
  char text[160];
  std::snprintf(text,
                sizeof(text),
                ", texture of %d x %d, %.2g MB, %.0f %% of its texels from %d photos",
                texture.image.width,
                texture.image.height,
                static_cast<double>(texture.file.size()) / 1e6,
                100.0 * static_cast<double>(texture.num_photo_texels) /
                    static_cast<double>(std::max<int64_t>(1, texture.num_texels)),
                texture.num_photos);
  return text;
}

// "1204 vertices, 2404 faces".
std::string Size(const ObjectSurface& surface) {
  return std::to_string(surface.vertices.size()) + " vertices, " +
         std::to_string(surface.triangles.size()) + " faces";
}

MadeSurface MakeSurface(const ExportableScene& scene,
                        const ObjectInfo& whole,
                        const SurfaceExportOptions& options) {
  MadeSurface made;
  const Eigen::AlignedBox3d box = BoxOf(scene, whole, options);
  ObjectInfo object = whole;
  object.cells = CellsInBox(scene, whole.cells, box);
  const bool is_cut = object.cells.size() < whole.cells.size();
  if (object.cells.empty()) return made;
  std::string faces, more;
  bool is_sheet = false;
  if (options.method == SurfaceMethod::kSmooth) {
    const std::vector<ContactPlane> contacts = ContactPlanes(scene, object);
    object.cells = CutBoundary(scene,
                               contacts,
                               CellsUpToContacts(scene, contacts, object.cells),
                               box,
                               /*opens_hollows=*/object.id != kNoObject);
    CleanCells clean = FillPitsAndTunnels(scene, object.cells);
    object.cells = CellsInBox(scene, CellsUpToContacts(scene, contacts, clean.cells), box);
    if (object.cells.empty()) return made;
    more = Counted(clean.pits, "pit", "filled") + Counted(clean.tunnels, "thin tunnel", "closed");
    const ObjectSurface cells = ExtractSurface(scene, object);
    made.surface = ExtractSmoothSurface(scene, object, cells, box, contacts);
    if (std::optional<ObjectSurface> sheet = SheetOf(object, made.surface, is_cut, options)) {
      made.surface = *std::move(sheet);
      is_sheet = true;
    }
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
    more += DistanceSummary(made.surface, cells, is_sheet);
  } else {
    ObjectSurface cells = ExtractSurface(scene, object);
    const int64_t far = CountFarVertices(scene, cells);
    return WithSummary(std::move(cells), CountComponents(scene, object.cells), far);
  }
  std::string topology;
  if (is_sheet) {
    const SheetTopology of_sheet = TopologyOfSheet(made.surface);
    topology = "a sheet of " + std::to_string(of_sheet.pieces) +
               (of_sheet.pieces == 1 ? " piece, " : " pieces, ") + std::to_string(of_sheet.rims) +
               (of_sheet.rims == 1 ? " rim" : " rims");
  } else {
    topology = TopologySummary(TopologyOf(made.surface.vertices.size(), made.surface.triangles),
                               CountComponents(scene, object.cells));
  }
  made.summary = Size(made.surface) + faces + ", " + topology + more;
  return made;
}

// Writes the files of one object after the other, and then those of the scene.
class SurfaceFiles {
 public:
  SurfaceFiles(const ExportableScene& scene,
               const std::filesystem::path& output_path,
               const SurfaceExportOptions& options,
               bool writes_scene_glb,
               const std::function<void(const WrittenFile&)>& on_written)
      : scene_(scene),
        output_path_(output_path),
        options_(options),
        writes_scene_glb_(options.glb && writes_scene_glb),
        on_written_(on_written),
        scene_glb_(scene.transform, options.creator) {
    if (options.usda) {
      scene_usda_.emplace(output_path / "scene.usda", scene.transform, options.creator);
    }
  }

  void WriteObject(const ObjectInfo& object, MadeSurface made) {
    const bool is_whole = object.id == kNoObject;
    const ObjectSurface& surface = made.surface;
    if (surface.triangles.empty()) return;
    const std::string stem = is_whole ? "scene" : "objects/" + object.file_stem;
    const auto write = [&](bool wanted, const char* extension, const auto& writer) {
      if (!wanted) return;
      writer(output_path_ / (stem + extension), surface);
      AddWritten(object.id, stem + extension, made.summary, made.warning);
    };
    const std::optional<SurfaceTexture> baked = MakeTexture(object, surface);
    const SurfaceTexture* const texture = baked ? &*baked : nullptr;
    const std::string image = texture ? stem + "." + texture->extension : "";
    if (texture) made.summary += TextureSummary(*texture);
    write(options_.om, ".om", WriteOm);
    write(options_.ply, ".ply", WritePly);
    write(options_.obj, ".obj", [&](const std::filesystem::path& path, const auto&) {
      WriteObj(path, surface, texture);
    });
    write(options_.obj, ".mtl", [&](const std::filesystem::path& path, const auto&) {
      WriteMtl(path, surface, std::filesystem::path(image).filename().string());
    });
    if (texture && (options_.obj || options_.usda)) {
      WriteTextFile(output_path_ / image, texture->file);
      AddWritten(object.id, image, made.summary);
    }
    ++num_objects_;
    if (is_whole) scene_summary_ = made.summary;
    if (!options_.glb && !options_.usda) return;

    const LocalMesh mesh = MakeLocalMesh(surface);
    write(options_.glb && !is_whole, ".glb", [&](const std::filesystem::path& path, const auto&) {
      GlbFile glb(scene_.transform, options_.creator);
      glb.Add(object, surface, mesh, texture);
      glb.Write(path);
    });
    if (writes_scene_glb_) scene_glb_.Add(object, surface, mesh, texture);
    if (scene_usda_) AddToStage(object, {surface, mesh, texture, image}, stem + ".vdb");
  }

  // Returns all that was written.
  std::vector<WrittenFile> WriteScene() {
    if (num_objects_ == 0) return {};
    const std::string summary =
        !scene_summary_.empty()
            ? scene_summary_
            : std::to_string(num_objects_) + (num_objects_ == 1 ? " object" : " objects");
    if (writes_scene_glb_) {
      scene_glb_.Write(output_path_ / "scene.glb");
      AddWritten(kNoObject, "scene.glb", summary);
    }
    if (scene_usda_) {
      scene_usda_->Finish();
      AddWritten(kNoObject, "scene.usda", summary, usda_warning_);
    }
    return std::move(files_);
  }

 private:
  std::optional<SurfaceTexture> MakeTexture(const ObjectInfo& object,
                                            const ObjectSurface& surface) const {
    if (options_.photos == nullptr || !(options_.obj || options_.glb || options_.usda)) return {};
    return BakeTexture(scene_, object, surface, *options_.photos, options_.texture);
  }

  // `volume_path` is where the object's volume lies, if it does.
  void AddToStage(const ObjectInfo& object,
                  const UsdSurface& surface,
                  const std::string& volume_path) {
    std::vector<VolumeField> volume_fields;
    try {
      volume_fields = ReadVolumeFields(output_path_ / volume_path, options_.source_checksum);
    } catch (const UserError& error) {
      // The surfaces are no worse for it.
      usda_warning_ += usda_warning_.empty() ? "does without " : " ";
      usda_warning_ += error.what();
    }
    scene_usda_->Add(object, surface, volume_path, volume_fields);
  }

  void AddWritten(LabelId object_id,
                  const std::string& path,
                  const std::string& summary,
                  const std::string& warning = {}) {
    files_.push_back({object_id, path.substr(path.rfind('.') + 1), path, summary, warning});
    if (on_written_) on_written_(files_.back());
  }

  const ExportableScene& scene_;
  const std::filesystem::path& output_path_;
  const SurfaceExportOptions& options_;
  const bool writes_scene_glb_;
  const std::function<void(const WrittenFile&)>& on_written_;
  GlbFile scene_glb_;
  std::optional<UsdFile> scene_usda_;
  std::string usda_warning_;
  size_t num_objects_ = 0;
  // Of the whole scene as one surface.
  std::string scene_summary_;
  std::vector<WrittenFile> files_;
};

}  // namespace

std::string SurfaceExportOptions::Check() const {
  if (target_faces != 0 && target_faces < 4) {
    return "target_faces must be at least 4, the faces of a tetrahedron, or 0 for all there are.";
  }
  if (target_faces != 0 && method != SurfaceMethod::kSmooth) {
    return "target_faces needs the method smooth; cells are exact and keep all their faces.";
  }
  if (close_sheets && method != SurfaceMethod::kSmooth) {
    return "close_sheets needs the method smooth; surfaces of cells are closed anyway.";
  }
  if (!crop.empty() && !ParseCrop(crop)) {
    return "crop must be six numbers x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1 and z0 < z1; it is '" +
           crop + "'.";
  }
  return texture.Check();
}

std::vector<WrittenFile> ExportSurfaces(const ExportableScene& scene,
                                        const std::filesystem::path& output_path,
                                        const SurfaceExportOptions& options,
                                        const std::function<void(const WrittenFile&)>& on_written) {
  CHECK_EQ(options.Check(), "");
  const std::vector<const ObjectInfo*> objects = SelectObjects(scene, options.objects);
  if (objects.empty()) return {};
  SurfaceFiles files(scene, output_path, options, /*writes_scene_glb=*/true, on_written);
  for (const ObjectInfo* const object : objects) {
    files.WriteObject(*object, MakeSurface(scene, *object, options));
  }
  return files.WriteScene();
}

MadeSurface WithSummary(ObjectSurface cells, int64_t components, int64_t far_vertices) {
  MadeSurface made;
  made.summary = Size(cells) + ", " +
                 TopologySummary(TopologyOf(cells.vertices.size(), cells.triangles), components);
  if (far_vertices > 0) {
    made.summary += ", " + std::to_string(far_vertices) + " vertices stick out into empty space";
  }
  made.surface = std::move(cells);
  return made;
}

std::vector<WrittenFile> ExportMadeSurfaces(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options,
    const std::function<MadeSurface(const ObjectInfo&)>& make,
    const std::function<void(const WrittenFile&)>& on_written) {
  CHECK_EQ(options.Check(), "");
  CHECK(options.photos == nullptr);
  const std::vector<const ObjectInfo*> objects = SelectObjects(scene, options.objects);
  if (objects.empty()) return {};
  SurfaceFiles files(scene, output_path, options, /*writes_scene_glb=*/false, on_written);
  for (const ObjectInfo* const object : objects) files.WriteObject(*object, make(*object));
  return files.WriteScene();
}

std::vector<WrittenFile> ExportWholeSurface(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written) {
  CHECK_EQ(options.Check(), "");
  if (scene.objects.empty()) return {};
  SurfaceFiles files(scene, output_path, options, /*writes_scene_glb=*/true, on_written);
  for (ObjectInfo whole : scene.objects) {
    whole.id = kNoObject;
    files.WriteObject(whole, MakeSurface(scene, whole, options));
  }
  return files.WriteScene();
}

}  // namespace semfoam
