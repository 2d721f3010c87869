// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/evaluation/polygon_soup.h"

#include <filesystem>

namespace semfoam {

// Reads the vertices (x, y, z) and faces (vertex_indices or vertex_index) of a PLY, in text or in
// binary of either byte order; none where it has no element vertex or face. Skips everything else,
// also after the last record. Takes memory in proportion to the file, for any counts in it. Throws
// UserError, one sentence naming the file, where it cannot be read, ends too early, has a text that
// is no number, or a list longer than the rest of the file.
PolygonSoup ReadPlyMesh(const std::filesystem::path& path);

}  // namespace semfoam
