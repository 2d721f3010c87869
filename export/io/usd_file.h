// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/byte_writer.h"
#include "export/io/local_mesh.h"
#include "export/io/volume_fields.h"
#include "export/scene/object_surface.h"
#include "export/texture/surface_texture.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// A surface for a stage: itself, its LocalMesh, and its texture (null: none) with the path of the
// image, relative to the stage, with '/'.
struct UsdSurface {
  const ObjectSurface& surface;
  const LocalMesh& mesh;
  const SurfaceTexture* texture = nullptr;
  std::string image_path = {};
};

// Writes a text USD stage (.usda) of all objects, in the file frame. upAxis is Y where that frame
// is y-up, else Z; metersPerUnit is the frame's (1 where its unit is unknown).
//
//   /scene              Xform
//     /scene/mug        Xform, one per object: SemanticsLabelsAPI:class with the label's name,
//                       customData: id, name, confidence
//       surface         Mesh: points (float) near an origin of its own, which xformOp:translate
//                       keeps in double; normals, displayColor in linear light and confidence per
//                       vertex, label; drawn as it is (no subdivision). With a texture also st
//                       per corner, and `material`, a UsdPreviewSurface with the texture
//       volume          Volume, only where the object's .vdb is there: the fields that it has of
//                       density, color, label, confidence and surface, whatever its grids are
//                       called. Invisible, so that it does not cover the surface
//
//       material        only with a texture
//
// Prims are named after the labels, in the characters that USD allows: [A-Za-z0-9_], no digit
// first, unique.
class UsdFile {
 public:
  // Begins the file at `path`. `creator` is program and version. Throws UserError where no file can
  // be created.
  UsdFile(const std::filesystem::path& path,
          const ExportTransform& transform,
          const std::string& creator);

  // Adds an object and its surface. `volume_path` is its .vdb, relative to the stage, with '/';
  // `volume_fields` are the fields in it, empty without a .vdb.
  void Add(const ObjectInfo& object,
           const UsdSurface& surface,
           const std::string& volume_path,
           const std::vector<VolumeField>& volume_fields);

  // Ends the file. Throws UserError when it cannot be written completely.
  void Finish();

 private:
  std::string PrimName(const ObjectInfo& object);

  ByteWriter out_;
  std::set<std::string> prim_names_;
};

}  // namespace semfoam
