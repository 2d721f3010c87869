// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Writes each object of a labelled PLY (CopyPlyWithLabels) as a file of its own,
// objects/<id>_<name>.ply in `folder`: of a mesh the faces with its label and their vertices, of a
// cloud its points. Vertices and faces keep their order and all of their properties, byte for byte
// but for the indices of corners; vertices on the border of two objects are in both files. Where an
// object meets another one, its mesh is open; with `cap`, the boundary loops of meshes are closed
// (FindBoundaryCaps): what caps carry besides places and corners is that of a vertex of the loop
// and of a face beside it, and they follow the others. Elements other than vertices and faces are
// left out. Returns the files, by ascending id; labels that nothing has, and that of id 0, get
// none. `labels` is the table of names.
//
// Throws UserError, one sentence naming the file, where `labelled` cannot be read, or a file cannot
// be written.
std::vector<WrittenFile> SplitLabelledPly(const std::filesystem::path& labelled,
                                          const std::filesystem::path& folder,
                                          const std::vector<Label>& labels,
                                          bool cap = false);

}  // namespace semfoam
