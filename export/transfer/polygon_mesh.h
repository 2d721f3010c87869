// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"
#include "foam/util/ply_reader.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A label on a vertex, a point or a face.
struct SurfaceLabel {
  // kNoObject: no label.
  LabelId id = kNoObject;
  // 0..1.
  float confidence = 0;

  bool operator==(const SurfaceLabel&) const = default;
};

inline constexpr uint32_t kNoVertex = std::numeric_limits<uint32_t>::max();

// A mesh of any polygons: they need be neither closed nor manifold nor oriented.
struct PolygonMesh {
  // May be not finite.
  std::vector<Eigen::Vector3d> vertices;
  // [vertices] As in the file, of any length; empty where it has none.
  std::vector<Eigen::Vector3f> normals;
  // [faces + 1] CSR: the corners of face f are corners[first_corner[f]] .. [first_corner[f + 1]].
  std::vector<uint64_t> first_corner = {0};
  std::vector<uint32_t> corners;

  size_t NumFaces() const { return first_corner.size() - 1; }
  std::span<const uint32_t> Face(size_t f) const {
    return {corners.data() + first_corner[f], corners.data() + first_corner[f + 1]};
  }

  // Returns the vector of the face's area: along its normal, by the right hand about its corners,
  // and as long as its area; that of a polygon that is not plane is the mean over all directions.
  // Not finite where a corner is not.
  Eigen::Vector3d FaceArea(size_t f) const;
};

// Columns of a PLY's vertices.
struct PlyVertexColumns {
  std::array<size_t, 3> position;
  // Nothing: no normals.
  std::optional<std::array<size_t, 3>> normal;
};
// Finds x, y, z, and nx, ny, nz. Throws UserError without the first three.
PlyVertexColumns FindVertexColumns(const PlyReader& reader, const PlyElement& element);

bool IsPlyVertices(const PlyElement& element);
bool IsPlyFaces(const PlyElement& element);
// Returns the column of the faces' corners. Throws UserError without any.
size_t FindCornerColumn(const PlyReader& reader, const PlyElement& element);

// Reads the vertices and faces of a PLY, in text or in binary of either byte order; none where it
// has no element for them. Skips everything else, also after the last record. A corner that is no
// index is kNoVertex, and others are not checked. Takes memory in proportion to the file, for any
// counts in it. Throws UserError, one sentence naming the file, where it cannot be read, ends too
// early, has a text that is no number, or a list longer than the rest of the file.
PolygonMesh ReadPolygonMesh(const std::filesystem::path& path);

// Throws UserError where a mesh read from `path` has no vertices, or a corner that is none of them.
void RequireValidMesh(const std::filesystem::path& path, const PolygonMesh& mesh);

}  // namespace semfoam
