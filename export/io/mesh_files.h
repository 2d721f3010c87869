// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"
#include "export/texture/surface_texture.h"

#include <filesystem>
#include <string>

namespace semfoam {

// Writes surfaces in PLY and OBJ. Positions keep every bit; colours are display values. All
// functions throw UserError when the file cannot be written completely.

// Writes a PLY, binary little-endian. vertex: double x y z, uchar red green blue, int label, float
// confidence. face: list uchar int vertex_indices, uchar red green blue, int label, float
// confidence. The object's name and id are in comments.
void WritePly(const std::filesystem::path& path, const ObjectSurface& surface);

// Writes a Wavefront OBJ: `o`, `g` and `usemtl` named after the file, `v x y z r g b` with colours
// in 0..1 (the extension that Blender, MeshLab and CloudCompare read), `f` with indices from 1. The
// label's id is in a comment. Refers to the material file beside it, which WriteMtl writes. With a
// texture also `vt`, and `f` with both indices; vertices are no more than without.
void WriteObj(const std::filesystem::path& path,
              const ObjectSurface& surface,
              const SurfaceTexture* texture = nullptr);

// Writes the material of the object's OBJ: matt, with the texture in the file `texture_name` beside
// it; if that is empty, in the mean colour of its vertices, for programs that do not read vertex
// colours.
void WriteMtl(const std::filesystem::path& path,
              const ObjectSurface& surface,
              const std::string& texture_name = {});

}  // namespace semfoam
