// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Any triangles: they need be neither closed nor manifold nor oriented.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Reads .ply (ReadPlyMesh), .om (ReadOmMesh), .obj, .off and .stl (CGAL, which keeps doubles and
// faces that are not manifold), with memory in proportion to the file, for any counts in its
// header. Faces with more corners are cut into a fan. Throws UserError when the file cannot be
// read, is of another kind, has a face with a corner that is no vertex or no finite number, or has
// no face with an area.
TriangleMesh ReadTriangleMesh(const std::filesystem::path& path);

// Reads the vertices of a .ply with or without faces. Throws UserError when there are none.
std::vector<Eigen::Vector3d> ReadPlyPoints(const std::filesystem::path& path);

// Samples `count` points on the surface, evenly by area: one in each of `count` parts of equal
// area, in the order of the triangles, at a position in it that depends on its index alone. The
// mesh must have area.
std::vector<Eigen::Vector3d> SampleSurface(const TriangleMesh& mesh, int64_t count);

// Returns the distance of every query to the nearest of `points`, which must not be empty.
std::vector<double> DistancesToPoints(const std::vector<Eigen::Vector3d>& points,
                                      const std::vector<Eigen::Vector3d>& queries);

// Returns the distance of every point to the nearest point of the surface, exact to rounding. The
// mesh must have area.
std::vector<double> DistancesToSurface(const TriangleMesh& mesh,
                                       const std::vector<Eigen::Vector3d>& points);

}  // namespace semfoam
