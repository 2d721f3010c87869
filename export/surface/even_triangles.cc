// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/even_triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

constexpr double kMaxTurn = 15 * M_PI / 180;
// Of the cotangents, so that rounding flips nothing back and forth.
constexpr double kLeastGain = 1e-3;
// Triangles of less than this share of their longest side's square have no direction of their own.
constexpr double kSliverArea = 0.02;
constexpr int kMaxRounds = 10;

// Cotangent of the angle at `apex`; infinite without area.
double Cotangent(const Vector3d& apex, const Vector3d& a, const Vector3d& b) {
  return (a - apex).dot(b - apex) / (a - apex).cross(b - apex).norm();
}

// Normal with the length of twice the area.
Vector3d AreaNormal(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return (b - a).cross(c - a);
}

bool IsSliver(const Vector3d& normal, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double longest =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return normal.norm() < 2 * kSliverArea * longest;
}

bool IsAlong(const Vector3d& normal, const Vector3d& direction) {
  return normal.dot(direction) > std::cos(kMaxTurn) * normal.norm() * direction.norm();
}

// Whether the triangles abc and bad had better be dca and cdb: if the angles at c and d are more
// than 180 degrees together.
bool IsBetterFlipped(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  if (!(Cotangent(c, a, b) + Cotangent(d, a, b) < -kLeastGain)) return false;
  const Vector3d abc = AreaNormal(a, b, c), bad = AreaNormal(b, a, d), mean = abc + bad;
  return IsAlong(AreaNormal(d, c, a), mean) && IsAlong(AreaNormal(c, d, b), mean) &&
         (IsSliver(abc, a, b, c) || IsAlong(abc, mean)) &&
         (IsSliver(bad, b, a, d) || IsAlong(bad, mean));
}

}  // namespace

Triangles EvenTriangles(const Triangles& surface,
                        const std::vector<Vector3d>& positions,
                        const std::vector<uint8_t>& is_fixed) {
  CHECK_EQ(positions.size(), is_fixed.size());
  OpenMesh::TriMesh_ArrayKernelT<> mesh;
  mesh.reserve(positions.size(), 3 * surface.size() / 2, surface.size());
  std::vector<OpenMesh::SmartVertexHandle> vertices;
  vertices.reserve(positions.size());
  for (size_t v = 0; v < positions.size(); ++v) vertices.push_back(mesh.add_vertex({}));
  for (const auto& [a, b, c] : surface) {
    CHECK(mesh.add_face(vertices[a], vertices[b], vertices[c]).is_valid())
        << "the surface is not manifold";
  }
  std::vector<uint8_t> is_open(mesh.n_edges(), 1);
  for (int round = 0, flips = 1; round < kMaxRounds && flips > 0; ++round) {
    flips = 0;
    for (const auto edge : mesh.edges()) {
      if (!is_open[edge.idx()]) continue;
      is_open[edge.idx()] = 0;
      const auto h0 = edge.h0(), h1 = edge.h1();
      const std::array<int, 4> corners = {
          h0.from().idx(), h0.to().idx(), h0.next().to().idx(), h1.next().to().idx()};
      const auto& [a, b, c, d] = corners;
      if (!IsBetterFlipped(positions[a], positions[b], positions[c], positions[d]) ||
          std::any_of(corners.begin(), corners.end(), [&](int v) { return is_fixed[v] != 0; }) ||
          !mesh.is_flip_ok(edge)) {
        continue;
      }
      for (const auto side : {h0.next(), h0.prev(), h1.next(), h1.prev()}) {
        is_open[side.edge().idx()] = 1;
      }
      mesh.flip(edge);
      ++flips;
    }
  }
  Triangles triangles;
  triangles.reserve(mesh.n_faces());
  for (const auto face : mesh.faces()) {
    auto corner = triangles.emplace_back().begin();
    for (const auto vertex : face.vertices()) *corner++ = static_cast<uint32_t>(vertex.idx());
  }
  return triangles;
}

}  // namespace semfoam
