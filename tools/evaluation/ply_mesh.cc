// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/ply_mesh.h"

#include "foam/util/ply_reader.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

size_t CornerOf(double value) {
  constexpr double kMost = 1e15;  // below, doubles are exact
  return value >= 0 && value < kMost && value == std::floor(value) ? static_cast<size_t>(value)
                                                                   : SIZE_MAX;
}

}  // namespace

PolygonSoup ReadPlyMesh(const fs::path& path) {
  PlyReader reader(path, "a PLY of points or faces");
  PolygonSoup mesh;
  for (const PlyElement& element : reader.header().elements) {
    if (element.count > 0 && (element.name == "vertex" || element.name == "vertices")) {
      const size_t columns[] = {reader.RequireProperty(element, {"x"}),
                                reader.RequireProperty(element, {"y"}),
                                reader.RequireProperty(element, {"z"})};
      const size_t first_vertex = mesh.vertices.size();
      reader.ReadRecords(element, [&](uint64_t i, size_t column, double value) {
        if (first_vertex + i == mesh.vertices.size()) mesh.vertices.emplace_back(0, 0, 0);
        for (int axis = 0; axis < 3; ++axis) {
          if (column == columns[axis]) mesh.vertices.back()[axis] = value;
        }
      });
    } else if (element.count > 0 && (element.name == "face" || element.name == "faces")) {
      const size_t corners =
          reader.RequireProperty(element, {"vertex_indices", "vertex_index"}, /*is_list=*/true);
      uint64_t face = element.count;  // none yet
      reader.ReadRecords(element, [&](uint64_t i, size_t column, double value) {
        if (column != corners) return;
        if (i != face) mesh.faces.emplace_back();
        face = i;
        mesh.faces.back().push_back(CornerOf(value));
      });
    } else {
      reader.ReadRecords(element, [](uint64_t, size_t, double) {});
    }
  }
  return mesh;
}

}  // namespace semfoam
