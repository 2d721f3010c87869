// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/ply_mesh.h"

namespace semfoam {

PolygonSoup ReadPlyMesh(const std::filesystem::path& path) { return SoupOf(ReadPolygonMesh(path)); }

}  // namespace semfoam
