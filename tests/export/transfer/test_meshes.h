// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/byte_writer.h"
#include "export/transfer/polygon_mesh.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>

// Meshes and clouds to be labelled.
namespace semfoam {

inline void AddFace(const std::vector<uint32_t>& corners, PolygonMesh* mesh) {
  mesh->corners.insert(mesh->corners.end(), corners.begin(), corners.end());
  mesh->first_corner.push_back(mesh->corners.size());
}

// Adds a ball of triangles.
inline void AddBall(const Eigen::Vector3d& center, double radius, int rings, PolygonMesh* mesh) {
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  const int around = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const double down = std::numbers::pi * i / rings, turn = 2 * std::numbers::pi * k / around;
      mesh->vertices.push_back(center + radius * Eigen::Vector3d(std::sin(down) * std::cos(turn),
                                                                 std::sin(down) * std::sin(turn),
                                                                 std::cos(down)));
    }
  }
  const auto at = [&](int i, int k) {
    return first + static_cast<uint32_t>(i * around + k % around);
  };
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < around; ++k) {
      if (i > 0) AddFace({at(i, k), at(i + 1, k), at(i, k + 1)}, mesh);
      if (i + 1 < rings) AddFace({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)}, mesh);
    }
  }
}

// Adds a grid of size x size squares of edge 1 in the plane z = 0, turned about the y axis by
// `degrees`: the ground for positive x, a slope that leaves it at x = 0 for negative ones.
inline void AddFoldedGrid(int size, double degrees, PolygonMesh* mesh) {
  const double turn = degrees * std::numbers::pi / 180;
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  for (int y = 0; y <= size; ++y) {
    for (int x = 0; x <= size; ++x) {
      const double along = x - size / 2;
      mesh->vertices.emplace_back(
          along < 0 ? along * std::cos(turn) : along, y, along < 0 ? -along * std::sin(turn) : 0);
    }
  }
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const uint32_t corner = first + y * (size + 1) + x;
      AddFace({corner, corner + 1, corner + size + 2, corner + size + 1}, mesh);
    }
  }
}

// The mesh as a PLY with doubles; without faces, and with the normals if there are any, where
// `is_cloud`.
inline std::string PlyOf(const PolygonMesh& mesh, bool is_cloud = false) {
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                    std::to_string(mesh.vertices.size()) +
                    "\nproperty double x\nproperty double y\nproperty double z\n";
  if (!mesh.normals.empty()) ply += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!is_cloud) {
    ply += "element face " + std::to_string(mesh.NumFaces()) +
           "\nproperty list uchar uint vertex_indices\n";
  }
  ply += "end_header\n";
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (const double x : mesh.vertices[v]) AppendBinary(x, &ply);
    if (mesh.normals.empty()) continue;
    for (const float x : mesh.normals[v]) AppendBinary(x, &ply);
  }
  for (size_t f = 0; f < mesh.NumFaces() && !is_cloud; ++f) {
    AppendBinary(static_cast<uint8_t>(mesh.Face(f).size()), &ply);
    for (const uint32_t corner : mesh.Face(f)) AppendBinary(corner, &ply);
  }
  return ply;
}

// The mesh of triangles as a binary STL, with a normal of (0.5, 0.5, 0.5) and the lowest bits of
// its index on each facet.
inline std::string StlOf(const PolygonMesh& mesh, std::string header) {
  header.resize(80);
  AppendBinary(static_cast<uint32_t>(mesh.NumFaces()), &header);
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    for (int axis = 0; axis < 3; ++axis) AppendBinary(0.5f, &header);
    for (const uint32_t corner : mesh.Face(f)) {
      for (const double x : mesh.vertices[corner]) AppendBinary(static_cast<float>(x), &header);
    }
    AppendBinary(static_cast<uint16_t>(f), &header);
  }
  return header;
}

// The labels and confidences in a PLY, by element and record.
struct PlyLabels {
  std::vector<SurfaceLabel> vertices;
  std::vector<SurfaceLabel> faces;
};
inline PlyLabels ReadPlyLabels(const std::filesystem::path& path) {
  PlyReader reader(path, "a PLY of points or faces");
  PlyLabels labels;
  for (const PlyElement& element : reader.header().elements) {
    auto& of = element.name == "vertex" ? labels.vertices : labels.faces;
    const size_t label = reader.RequireProperty(element, {"label"});
    const size_t confidence = reader.RequireProperty(element, {"confidence"});
    reader.ReadRecords(element, [&](uint64_t i, size_t column, double value) {
      if (of.size() == i) of.emplace_back();
      if (column == label) of.back().id = LabelId{static_cast<int32_t>(value)};
      if (column == confidence) of.back().confidence = static_cast<float>(value);
    });
  }
  return labels;
}

}  // namespace semfoam
