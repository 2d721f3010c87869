// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "export/texture/texture_baker.h"
#include "export/texture/texture_photos.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace semfoam {

enum class SurfaceMethod {
  // The faces between the object's cells and all others, exact (ExtractSurface).
  kCells,
  // An iso-surface on the Delaunay tetrahedra, smoothed (ExtractSmoothSurface).
  kSmooth,
};
inline constexpr EnumName<SurfaceMethod> kSurfaceMethodNames[] = {
    {SurfaceMethod::kCells, "cells"}, {SurfaceMethod::kSmooth, "smooth"}};

struct SurfaceExportOptions {
  SurfaceMethod method = SurfaceMethod::kSmooth;
  // Maximum number of triangles of each object (Decimate), for kSmooth only; 0: no maximum.
  int64_t target_faces = 0;

  // Box "x0,y0,z0,x1,y1,z1" in the COLMAP frame to cut the surfaces at (kCells: to take the cells
  // whose sites are in it); empty: for kSmooth SurfaceBox of each object, for kCells none.
  std::string crop;

  // Whether to close also walls and floors (IsSheet) and a scene without labels, of which photos
  // show one side, by the back of their cells; for kSmooth only. Otherwise these are sheets with
  // rims (OpenSheet).
  bool close_sheets = false;

  // The objects to write, and to include in the files of the scene.
  LabelFilter objects;

  // Whether to write OpenMesh files: all data, lossless, in double.
  bool om = true;
  // Whether to write binary PLY: positions in double, label and confidence on vertices and faces.
  bool ply = true;
  // Whether to write text OBJ: vertex colours, a material in a .mtl; no labels besides the name.
  bool obj = true;
  // Whether to write binary glTF, for each object and for the scene (glb_file.h).
  bool glb = true;
  // Whether to write text USD, for the scene (usd_file.h).
  bool usda = true;

  // The photos to bake textures from, for OBJ, glTF and USD; null: no textures. Must outlive the
  // export.
  const TexturePhotos* photos = nullptr;
  TextureOptions texture;

  // "creator" in glTF and USD: program and version.
  std::string creator = "Semantic Foam";
  // VolumeExportOptions::source_checksum, so that the stage does not refer to volumes of another
  // model. Empty: not known.
  std::string source_checksum;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// Writes `objects/<file stem>.{om,ply,obj,mtl,glb}` for every selected object, and
// `scene.{glb,usda}` if there is one, into `output_path`; with textures also `objects/<file
// stem>.{png,jpg}`, which OBJ and USD refer to (glTF files hold their own). The stage refers to
// those objects' volumes that exist in `output_path`. Calls `on_written` (if any) after each file.
// The summaries give counts, shells, cavities and genus (export/scene/surface_topology.h), of
// sheets pieces and rims; for `smooth` also the distance from the `cells` surface and the number of
// triangles that intersect (after a decimation), with a warning where it has more triangles than
// `target_faces`. CHECKs that the options are in range; throws UserError when a file cannot be
// written.
std::vector<WrittenFile> ExportSurfaces(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options = {},
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

// As ExportSurfaces, for a scene of MakeWholeScene: writes its only object as
// `scene.{om,ply,obj,mtl,glb,usda}`.
std::vector<WrittenFile> ExportWholeSurface(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options = {},
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

}  // namespace semfoam
