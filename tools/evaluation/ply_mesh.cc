// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/ply_mesh.h"

#include "export/transfer/polygon_mesh.h"

#include <cstdint>
#include <utility>

namespace semfoam {

PolygonSoup ReadPlyMesh(const std::filesystem::path& path) {
  PolygonMesh polygons = ReadPolygonMesh(path);
  PolygonSoup mesh;
  mesh.vertices = std::move(polygons.vertices);
  mesh.faces.reserve(polygons.NumFaces());
  for (size_t f = 0; f < polygons.NumFaces(); ++f) {
    if (polygons.Face(f).empty()) continue;  // an empty list of corners
    std::vector<size_t>& face = mesh.faces.emplace_back();
    for (const uint32_t corner : polygons.Face(f)) {
      face.push_back(corner == kNoVertex ? SIZE_MAX : corner);
    }
  }
  return mesh;
}

}  // namespace semfoam
