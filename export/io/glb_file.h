// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/local_mesh.h"
#include "export/scene/object_surface.h"
#include "export/texture/surface_texture.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// Data of an object for its node, its accessors and its row of the property table.
struct GlbObject {
  // ObjectInfo without its cells.
  ObjectInfo info;
  uint64_t num_cells = 0;
  // Origin of the vertices, file frame.
  Eigen::Vector3d origin;
  // Box of the vertices, relative to `origin`.
  Eigen::AlignedBox3f box;
  uint64_t num_vertices = 0;
  uint64_t num_indices = 0;
  // Offset of its vertices in the binary chunk; its indices follow, and then its texture.
  uint64_t first_byte = 0;
  // Bytes of the texture's file; 0: no texture.
  uint64_t texture_bytes = 0;
  // "image/png" or "image/jpeg".
  std::string texture_type;
};

// Writes a binary glTF 2.0 file of one or more objects. Its nodes:
//
//   scene     the turn that cancels what importers do to y-up files, so that Blender shows the
//             numbers of the file frame as x, y, z; none where the file frame is y-up itself.
//             Scaled to metres, glTF's one unit, where the frame's unit is known. extras: "frame",
//             as in ExportTransformJson.
//     origin  moves by a round number to about the middle of the objects, so that a scene at UTM
//             coordinates keeps its millimetres in programs that place nodes in float
//       mug   one per object, named after its label, moved to the object's own origin. extras:
//             "label" (id), "name", "confidence", "cells", "volume"
//
// A vertex has POSITION and NORMAL (float), COLOR_0 (linear light, 16-bit normalised), _CONFIDENCE
// (float), and by EXT_mesh_features _FEATURE_ID_0 (float), which is the row of its object in the
// property table of EXT_structural_metadata: id, name, color, confidence, cells, volume. Materials
// are matt. Objects without a texture share a white one, so that the vertex colours are visible.
// One with a texture has a material of its own, the texture's file in the binary chunk, and
// TEXCOORD_0; its colours are called _COLOR, because COLOR_0 would be multiplied with the texture,
// and a vertex on the borders of charts is there once for each of them.
class GlbFile {
 public:
  // `creator` is program and version.
  GlbFile(const ExportTransform& transform, std::string creator);

  // Adds an object and its surface, both in the file frame; with a texture, unless that is null.
  void Add(const ObjectInfo& object,
           const ObjectSurface& surface,
           const LocalMesh& mesh,
           const SurfaceTexture* texture = nullptr);

  // Throws UserError when the file cannot be written or would not fit into glTF's 4 GiB. Must be
  // called once, after at least one Add.
  void Write(const std::filesystem::path& path);

 private:
  ExportTransform transform_;
  std::string creator_;
  std::vector<GlbObject> objects_;
  // Vertices and indices of objects_, in the order of Add.
  std::string binary_;
};

}  // namespace semfoam
