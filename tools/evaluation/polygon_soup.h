// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/polygon_mesh.h"

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The unchecked content of a mesh file.
struct PolygonSoup {
  // May be not finite.
  std::vector<Eigen::Vector3d> vertices;
  // Corners; SIZE_MAX for a text that is no index of a vertex.
  std::vector<std::vector<size_t>> faces;
};

// Returns the same without faces that have an empty list of corners.
inline PolygonSoup SoupOf(PolygonMesh polygons) {
  PolygonSoup soup;
  soup.vertices = std::move(polygons.vertices);
  soup.faces.reserve(polygons.NumFaces());
  for (size_t f = 0; f < polygons.NumFaces(); ++f) {
    if (polygons.Face(f).empty()) continue;
    std::vector<size_t>& face = soup.faces.emplace_back();
    for (const uint32_t corner : polygons.Face(f)) {
      face.push_back(corner == kNoVertex ? SIZE_MAX : corner);
    }
  }
  return soup;
}

}  // namespace semfoam
