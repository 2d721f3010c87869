// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/error.h"
#include "foam/input_file.h"
#include "tools/mesh_distance.h"
#include "tools/om_mesh.h"
#include "tools/ply_mesh.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Simple_cartesian.h>
#include <Eigen/Geometry>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Point = CGAL::Simple_cartesian<double>::Point_3;

// CGAL makes its containers as large as a file says before it reads so much. No count of a file can
// be right that is larger than the file has bytes.
thread_local uintmax_t bytes_of_file = 0;
template <typename T>
struct BoundedVector : std::vector<T> {
  void resize(size_t size) {
    if (size > bytes_of_file) throw std::length_error("a count beyond the file");
    std::vector<T>::resize(size);
  }
};

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

PolygonSoup ReadWithCgal(const fs::path& path) {
  BoundedVector<Point> points;
  BoundedVector<BoundedVector<size_t>> faces;
  bytes_of_file = fs::file_size(path);
  bool read = false;
  try {
    read = CGAL::IO::read_polygon_soup(path.string(), points, faces);
  } catch (const std::exception&) {  // of BoundedVector, and CGAL's own
    FailUnreadable(path);
  }
  // CGAL calls an OBJ without faces a failure.
  if (!read && (points.empty() || !faces.empty())) FailUnreadable(path);
  PolygonSoup soup;
  for (const Point& point : points) soup.vertices.push_back(ToVector(point));
  for (BoundedVector<size_t>& face : faces) soup.faces.push_back(std::move(face));
  return soup;
}

}  // namespace

TriangleMesh ReadTriangleMesh(const fs::path& path) {
  RequireRegularFile(path, "a mesh");
  const std::string extension = LowerExtension(path);
  PolygonSoup soup = extension == ".ply"  ? ReadPlyMesh(path)
                     : extension == ".om" ? ReadOmMesh(path)
                                          : ReadWithCgal(path);
  TriangleMesh mesh;
  mesh.vertices = std::move(soup.vertices);
  for (std::vector<size_t>& polygon : soup.faces) {
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
  std::vector<Eigen::Vector3d> vertices;
  if (LowerExtension(path) == ".ply") vertices = ReadPlyMesh(path).vertices;
  const bool finite = std::all_of(
      vertices.begin(), vertices.end(), [](const Eigen::Vector3d& x) { return x.allFinite(); });
  if (vertices.empty() || !finite) {
    throw UserError(path.string(),
                    ": is no list of points that can be read; a .ply file with vertices is "
                    "needed, all of them with finite coordinates.");
  }
  return vertices;
}

}  // namespace semfoam
