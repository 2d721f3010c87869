// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <filesystem>

namespace semfoam {

// These writers keep every bit of the positions; colours are display values. They throw UserError
// when the file cannot be written completely.

// PLY, binary little-endian. vertex: double x y z, uchar red green blue, int label, float
// confidence. face: list uchar int vertex_indices, uchar red green blue, int label, float
// confidence. The object's name and id stand in comments.
void WritePly(const std::filesystem::path& path, const ObjectSurface& surface);

// Wavefront OBJ: `o`, `g` and `usemtl` named after the file, `v x y z r g b` with colours in 0..1
// (the extension that Blender, MeshLab and CloudCompare read), `f` with indices from 1. The label's
// id stands in a comment. Names the material file beside it, which WriteMtl makes.
void WriteObj(const std::filesystem::path& path, const ObjectSurface& surface);

// The one material of the object's OBJ: matt, in the mean colour of its vertices, for programs that
// do not read vertex colours.
void WriteMtl(const std::filesystem::path& path, const ObjectSurface& surface);

}  // namespace semfoam
