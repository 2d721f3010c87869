// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/evaluation/polygon_soup.h"

#include <filesystem>

namespace semfoam {

// The vertices (x, y, z) and faces (vertex_indices or vertex_index) of a PLY, as text or as bytes
// in either order; none where it has no element vertex or face. Everything else in it is read over,
// as is what follows the last record. Takes memory in proportion to the file, whatever counts are
// in it. Throws UserError, one sentence naming the file, where it cannot be read, ends too early,
// or has what is no number, or a list longer than the rest of the file.
PolygonSoup ReadPlyMesh(const std::filesystem::path& path);

}  // namespace semfoam
