// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/om_mesh.h"

#include "export/transfer/om_labels.h"

namespace semfoam {

PolygonSoup ReadOmMesh(const std::filesystem::path& path) {
  return SoupOf(ReadOmPolygonMesh(path));
}

}  // namespace semfoam
