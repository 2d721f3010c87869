// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_decimation.h"

#include "export/surface/semantic_mesh.h"

#include <vector>

#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kMaxTurnDegrees = 60;

}  // namespace

ObjectSurface Decimate(const ObjectSurface& surface, int64_t target_faces) {
  CHECK_GT(target_faces, 0);
  if (static_cast<int64_t>(surface.triangles.size()) <= target_faces) return surface;

  // Quadrics square the coordinates: near the origin, so that a far offset costs no digits.
  ObjectSurface near = surface;
  const Eigen::Vector3d origin = surface.vertices.front();
  for (Eigen::Vector3d& vertex : near.vertices) vertex -= origin;
  SemanticMesh mesh = ToSemanticMesh(near);
  mesh.request_vertex_status();
  mesh.request_edge_status();
  mesh.request_halfedge_status();
  mesh.request_face_status();
  mesh.request_face_normals();
  mesh.update_face_normals();

  OpenMesh::Decimater::DecimaterT<SemanticMesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<SemanticMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<SemanticMesh>::Handle flipping;
  CHECK(decimater.add(quadric));
  CHECK(decimater.add(flipping));
  decimater.module(quadric).unset_max_err();
  decimater.module(flipping).set_max_normal_deviation(kMaxTurnDegrees);
  CHECK(decimater.initialize());
  decimater.decimate_to_faces(0, static_cast<size_t>(target_faces));

  ObjectSurface result;
  result.object_id = surface.object_id;
  result.object_name = surface.object_name;
  std::vector<uint32_t> new_index(surface.vertices.size(), 0);
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    if (mesh.status(SemanticMesh::VertexHandle(static_cast<int>(v))).deleted()) continue;
    new_index[v] = static_cast<uint32_t>(result.vertices.size());
    result.vertices.push_back(surface.vertices[v]);
    result.vertex_color.push_back(surface.vertex_color[v]);
    result.vertex_confidence.push_back(surface.vertex_confidence[v]);
  }
  for (const auto face : mesh.faces()) {
    std::array<uint32_t, 3>& triangle = result.triangles.emplace_back();
    auto corner = triangle.begin();
    for (const auto vertex : face.vertices()) *corner++ = new_index[vertex.idx()];
  }
  ShowVerticesOnFaces(&result);
  return result;
}

}  // namespace semfoam
