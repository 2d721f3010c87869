// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace semfoam {

enum class SurfaceMethod {
  kCells,   // the faces between the object's cells and all others, exact (ExtractSurface)
  kSmooth,  // an iso-surface on the Delaunay tetrahedra, smoothed (ExtractSmoothSurface)
};
inline constexpr EnumName<SurfaceMethod> kSurfaceMethodNames[] = {
    {SurfaceMethod::kCells, "cells"}, {SurfaceMethod::kSmooth, "smooth"}};

struct SurfaceExportOptions {
  SurfaceMethod method = SurfaceMethod::kCells;
  // kSmooth only: at most so many triangles for each object (Decimate); 0 = all there are.
  int64_t target_faces = 0;

  LabelFilter objects;  // the others get no files, and are not in those of the scene

  bool om = true;   // OpenMesh: everything, lossless, in double
  bool ply = true;  // binary, positions in double, label and confidence on vertices and faces
  bool obj =
      true;  // text, vertex colours, a material in a .mtl; no labels beyond the object's name
  bool glb = true;   // binary glTF, per object and of the scene: see glb_file.h
  bool usda = true;  // text USD, of the scene: see usd_file.h

  // The "creator" that glTF and USD name: program and version.
  std::string creator = "Semantic Foam";
  // As VolumeExportOptions::source_checksum: the stage names no volume of another model. Empty =
  // not known.
  std::string source_checksum;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// Writes `objects/<file stem>.{om,ply,obj,mtl,glb}` for every object that the options have, and
// `scene.{glb,usda}` of them where there is one, into `output_path`. The stage names those objects'
// volumes that lie in `output_path` already. Calls `on_written` (if any) after each. What the files
// hold is said in the summaries: counts, shells, cavities and genus
// (export/scene/surface_topology.h); for `smooth` also how far the surface is from the `cells` one
// and how many triangles intersect (after a decimation), and in a warning where it has more
// triangles than asked for. CHECKs that the options are in range; throws UserError when a file
// cannot be written.
std::vector<WrittenFile> ExportSurfaces(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options = {},
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

}  // namespace semfoam
