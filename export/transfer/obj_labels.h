// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <filesystem>
#include <span>
#include <utility>
#include <vector>

namespace semfoam {

// Reads the vertices and faces of an OBJ; all else is skipped. Corners count from 1, or backwards
// from the last vertex before the face; one that is neither is kNoVertex, and others are not
// checked. Takes memory in proportion to the file. Throws UserError, one sentence naming file and
// line, where the file cannot be read, a vertex has no three numbers or a face no three corners, or
// there are no faces.
PolygonMesh ReadObjMesh(const std::filesystem::path& path);

// Copies the OBJ `input` to `output`, with a group for each label: a line `g ID_NAME` (FileStem; `g
// unlabelled` for kNoObject) before each face that has another label than the one before. The
// file's own lines `g` are left out; everything else stays as it is, byte for byte and in order:
// vertices, normals, texture coordinates, faces, materials, objects, comments. face_labels: one for
// each face of ReadObjMesh. `labels` is the table of names. Throws UserError as ReadObjMesh does,
// or where `output` cannot be written.
void CopyObjWithLabels(const std::filesystem::path& input,
                       const std::filesystem::path& output,
                       const std::vector<Label>& labels,
                       std::span<const SurfaceLabel> face_labels);

// Returns the files that show the materials of an OBJ, each with where it goes below `folder`: its
// material libraries and their textures, as far as they exist, by relative paths that do not leave
// the OBJ's folder. Throws UserError where a file is in the way there that differs.
std::vector<std::pair<std::filesystem::path, std::filesystem::path>> ObjMaterialFiles(
    const std::filesystem::path& obj, const std::filesystem::path& folder);

// Throws UserError, one sentence naming file and line, where a face has a corner without a vertex,
// texture coordinate or normal that stands before it: then SplitLabelledObj could not copy it.
void RequireSplittableObj(const std::filesystem::path& path);

// Writes each object as an OBJ of its own, objects/<id>_<name>.obj in `folder`: the faces of one
// label in their order and the lines `v`, `vt` and `vn` that they need, byte for byte but for the
// indices of corners, with the material library, and the lines `usemtl`, `s`, `o` and `mg` where
// they hold. Vertices on the border of two objects are in both files; with `cap`, boundary loops
// are closed (FindBoundaryCaps) by triangles without texture. Comments, lines and points go. The
// materials belong beside them (ObjMaterialFiles). `mesh` is that of ReadObjMesh. Returns the
// files, by ascending id. Throws UserError as RequireSplittableObj does, or where a file cannot be
// written.
std::vector<WrittenFile> SplitLabelledObj(const std::filesystem::path& input,
                                          const PolygonMesh& mesh,
                                          const std::filesystem::path& folder,
                                          const std::vector<Label>& labels,
                                          const std::vector<SurfaceLabel>& face_labels,
                                          bool cap);

// Copies these files.
void CopyFiles(
    const std::vector<std::pair<std::filesystem::path, std::filesystem::path>>& from_and_to);

}  // namespace semfoam
