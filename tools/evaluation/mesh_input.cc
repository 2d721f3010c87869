// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "tools/evaluation/mesh_distance.h"
#include "tools/evaluation/om_mesh.h"
#include "tools/evaluation/ply_mesh.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <limits>
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

// Returns the counts in the header of an OFF file, found where CGAL finds them: of vertices, of
// faces and, but for SKEL, of edges; before them, in nOFF, the number of dimensions.
std::vector<int64_t> OffCounts(std::istream& in) {
  constexpr auto kRestOfLine = std::numeric_limits<std::streamsize>::max();
  const auto next = [&] {
    char c = 0;
    while (in >> c && c == '#') in.ignore(kRestOfLine, '\n');
    return c;
  };
  char after = 0;
  const auto keyword = [&](char first) {
    std::string letters(1, first);
    while (in.get(after) && std::isalnum(static_cast<unsigned char>(after)) != 0) letters += after;
    return letters;
  };
  const std::string format = keyword(next());
  size_t size = format.ends_with("OFF") ? 3 : 2;
  if (format.find('n') != std::string::npos) ++size;
  std::vector<int64_t> counts;
  const char first = next();
  if (std::isdigit(static_cast<unsigned char>(first)) != 0) {
    in.putback(first);
    for (int64_t count = 0; counts.size() < size && in >> count;) counts.push_back(count);
  } else if (keyword(first) == "BINARY") {
    if (after != '\n') in.ignore(kRestOfLine, '\n');
    for (std::array<char, 4> bytes; counts.size() < size && in.read(bytes.data(), bytes.size());) {
      uint32_t count = 0;
      for (const char byte : bytes) count = count << 8 | static_cast<uint8_t>(byte);
      counts.push_back(static_cast<int32_t>(count));
    }
  }
  if (counts.size() < size) counts.clear();
  return counts;
}

// CGAL (5.5, File_header_OFF) computes with the counts of a header as int, a bit more than four
// times the largest, before it makes room for anything.
bool HasPossibleOffCounts(const fs::path& path) {
  const auto most = static_cast<int64_t>(std::min<uintmax_t>(fs::file_size(path), INT32_MAX / 5));
  std::ifstream in(path, std::ios::binary);
  const std::vector<int64_t> counts = OffCounts(in);
  return !counts.empty() && std::all_of(counts.begin(), counts.end(), [&](int64_t count) {
    return count >= 0 && count <= most;
  });
}

PolygonSoup ReadWithCgal(const fs::path& path) {
  if (LowerExtension(path) == ".off" && !HasPossibleOffCounts(path)) FailUnreadable(path);
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
