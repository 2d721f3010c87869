// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/semantic_mesh.h"
#include "foam/error.h"
#include "foam/input_file.h"
#include "tools/mesh_distance.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/IO/read_ply_points.h>
#include <CGAL/Simple_cartesian.h>
#include <Eigen/Geometry>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Polygons = std::vector<std::vector<size_t>>;

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension;
}

Eigen::Vector3d ToVector(const Point& point) { return {point.x(), point.y(), point.z()}; }

[[noreturn]] void FailUnreadable(const fs::path& path) {
  throw UserError(path.string(),
                  ": cannot be read as a mesh; .obj, .ply, .off, .stl and .om files can, where "
                  "they are complete.");
}

// What CGAL's reader takes for granted of a PLY's header: that an element stands before the first
// property, and that there are no more records than the file has bytes.
bool HasSoundHeader(const fs::path& path) {
  const uint64_t file_size = fs::file_size(path);
  std::ifstream file(path, std::ios::binary);
  std::string line;
  // "ply", and the format, whatever stands there.
  for (int i = 0; i < 2; ++i) std::getline(file, line);
  bool has_element = false;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string keyword, name;
    uint64_t count = 0;
    words >> keyword >> name >> count;
    if (keyword == "end_header") return has_element;
    if (keyword == "property" && !has_element) return false;
    if (keyword != "element") continue;
    // A minus sign wraps around.
    if (words.fail() || count > file_size) return false;
    has_element = true;
  }
  return false;
}

// False where the file cannot be read.
bool ReadOm(const fs::path& path, std::vector<Eigen::Vector3d>* vertices, Polygons* polygons) {
  SemanticMesh mesh;
  // OpenMesh tells the log of everything.
  const bool was_talking = omerr().is_enabled();
  omerr().disable();
  const bool read = OpenMesh::IO::read_mesh(mesh, path.string());
  if (was_talking) omerr().enable();
  if (!read) return false;
  for (const auto vertex : mesh.vertices()) {
    const auto& p = mesh.point(vertex);
    vertices->emplace_back(p[0], p[1], p[2]);
  }
  for (const auto face : mesh.faces()) {
    std::vector<size_t>& polygon = polygons->emplace_back();
    for (const auto vertex : mesh.fv_range(face)) {
      polygon.push_back(static_cast<size_t>(vertex.idx()));
    }
  }
  return true;
}

}  // namespace

TriangleMesh ReadTriangleMesh(const fs::path& path) {
  RequireRegularFile(path, "a mesh");
  TriangleMesh mesh;
  Polygons polygons;
  std::vector<Point> points;
  bool read = false;
  try {
    if (LowerExtension(path) == ".om") {
      read = ReadOm(path, &mesh.vertices, &polygons);
    } else if (LowerExtension(path) != ".ply" || HasSoundHeader(path)) {
      read = CGAL::IO::read_polygon_soup(path.string(), points, polygons);
    }
  } catch (const std::exception&) {  // a count that no memory holds, say
    FailUnreadable(path);
  }
  for (const Point& point : points) mesh.vertices.push_back(ToVector(point));
  // CGAL calls an OBJ without faces a failure.
  if (!read && (mesh.vertices.empty() || !polygons.empty())) FailUnreadable(path);
  for (std::vector<size_t>& polygon : polygons) {
    // From the lowest corner, so that a surface is the same whatever format it is in.
    std::rotate(polygon.begin(), std::min_element(polygon.begin(), polygon.end()), polygon.end());
    for (const size_t corner : polygon) {
      if (corner >= mesh.vertices.size() || !mesh.vertices[corner].allFinite()) {
        throw UserError(path.string(),
                        ": a face has a corner that is no vertex of the file with finite "
                        "coordinates; is it complete?");
      }
    }
    for (size_t k = 2; k < polygon.size(); ++k) {
      mesh.triangles.push_back({static_cast<uint32_t>(polygon[0]),
                                static_cast<uint32_t>(polygon[k - 1]),
                                static_cast<uint32_t>(polygon[k])});
    }
  }
  const bool has_area =
      std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& triangle) {
        const auto& [a, b, c] = triangle;
        return (mesh.vertices[b] - mesh.vertices[a])
                   .cross(mesh.vertices[c] - mesh.vertices[a])
                   .norm() > 0;
      });
  if (!has_area) {
    throw UserError(path.string(), ": has no face with an area; a mesh with a surface is needed.");
  }
  return mesh;
}

std::vector<Eigen::Vector3d> ReadPlyPoints(const fs::path& path) {
  RequireRegularFile(path, "a list of points");
  std::ifstream file(path, std::ios::binary);
  std::vector<Point> points;
  bool read = false;
  try {
    read = file && LowerExtension(path) == ".ply" && HasSoundHeader(path) &&
           CGAL::IO::read_PLY(file, std::back_inserter(points));
  } catch (const std::exception&) {
    read = false;
  }
  std::vector<Eigen::Vector3d> vertices;
  for (const Point& point : points) vertices.push_back(ToVector(point));
  const bool finite = std::all_of(
      vertices.begin(), vertices.end(), [](const Eigen::Vector3d& x) { return x.allFinite(); });
  if (!read || vertices.empty() || !finite) {
    throw UserError(path.string(),
                    ": is no list of points that can be read; a .ply file with vertices is "
                    "needed.");
  }
  return vertices;
}

}  // namespace semfoam
