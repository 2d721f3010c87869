// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/polygon_mesh.h"

#include "foam/util/error.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void ReadVertices(const PlyElement& element, PlyReader* reader, PolygonMesh* mesh) {
  const PlyVertexColumns columns = FindVertexColumns(*reader, element);
  reader->ReadRecords(element, [&](uint64_t i, size_t column, double value) {
    if (i == mesh->vertices.size()) {
      mesh->vertices.emplace_back(0, 0, 0);
      if (columns.normal) mesh->normals.emplace_back(0, 0, 0);
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (column == columns.position[axis]) mesh->vertices.back()[axis] = value;
      if (columns.normal && column == (*columns.normal)[axis]) {
        mesh->normals.back()[axis] = static_cast<float>(value);
      }
    }
  });
}

void ReadFaces(const PlyElement& element, PlyReader* reader, PolygonMesh* mesh) {
  const size_t corner_column = FindCornerColumn(*reader, element);
  reader->ReadRecords(
      element,
      [&](uint64_t, size_t column, double value) {
        if (column != corner_column) return;
        const bool is_index = value >= 0 && value < kNoVertex && value == std::floor(value);
        mesh->corners.push_back(is_index ? static_cast<uint32_t>(value) : kNoVertex);
      },
      [&](uint64_t, size_t column) {
        if (column == corner_column) mesh->first_corner.push_back(mesh->corners.size());
      });
}

}  // namespace

Eigen::Vector3d PolygonMesh::FaceArea(size_t f) const {
  const std::span<const uint32_t> face = Face(f);
  Eigen::Vector3d twice = Eigen::Vector3d::Zero();
  for (size_t k = 2; k < face.size(); ++k) {
    const Eigen::Vector3d& origin = vertices[face[0]];
    twice += (vertices[face[k - 1]] - origin).cross(vertices[face[k]] - origin);
  }
  return 0.5 * twice;
}

PlyVertexColumns FindVertexColumns(const PlyReader& reader, const PlyElement& element) {
  PlyVertexColumns columns = {{reader.RequireProperty(element, {"x"}),
                               reader.RequireProperty(element, {"y"}),
                               reader.RequireProperty(element, {"z"})},
                              {}};
  std::array<size_t, 3> normal;
  for (int axis = 0; axis < 3; ++axis) {
    constexpr std::string_view kNames[] = {"nx", "ny", "nz"};
    const auto found = std::find_if(
        element.properties.begin(), element.properties.end(), [&](const PlyProperty& property) {
          return property.name == kNames[axis] && !property.is_list;
        });
    if (found == element.properties.end()) return columns;
    normal[axis] = found - element.properties.begin();
  }
  columns.normal = normal;
  return columns;
}

bool IsPlyVertices(const PlyElement& element) {
  return element.name == "vertex" || element.name == "vertices";
}

bool IsPlyFaces(const PlyElement& element) {
  return element.name == "face" || element.name == "faces";
}

size_t FindCornerColumn(const PlyReader& reader, const PlyElement& element) {
  return reader.RequireProperty(element, {"vertex_indices", "vertex_index"}, /*is_list=*/true);
}

PolygonMesh ReadPolygonMesh(const fs::path& path) {
  PlyReader reader(path, "a PLY of points or faces");
  PolygonMesh mesh;
  for (const PlyElement& element : reader.header().elements) {
    if (element.count > 0 && IsPlyVertices(element)) {
      ReadVertices(element, &reader, &mesh);
    } else if (element.count > 0 && IsPlyFaces(element)) {
      ReadFaces(element, &reader, &mesh);
    } else {
      reader.ReadRecords(element, [](uint64_t, size_t, double) {});
    }
  }
  return mesh;
}

void RequireValidMesh(const fs::path& path, const PolygonMesh& mesh) {
  if (mesh.vertices.empty()) {
    throw UserError(path.string(), ": has no vertices; a mesh or a point cloud is needed.");
  }
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    for (const uint32_t corner : mesh.Face(f)) {
      if (corner < mesh.vertices.size()) continue;
      throw UserError(path.string(),
                      ": face ",
                      f,
                      " has a corner that is no vertex of the file, which has ",
                      mesh.vertices.size(),
                      "; is it damaged?");
    }
  }
}

}  // namespace semfoam
