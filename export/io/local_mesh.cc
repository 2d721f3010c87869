// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/local_mesh.h"

#include "foam/image/srgb.h"

#include <glog/logging.h>

namespace semfoam {

LocalMesh MakeLocalMesh(const ObjectSurface& surface) {
  LocalMesh mesh;
  if (surface.vertices.empty()) return mesh;
  // From the first vertex, so that nothing is lost to a far offset.
  const Eigen::Vector3d& first = surface.vertices.front();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : surface.vertices) sum += vertex - first;
  mesh.origin = first + sum / static_cast<double>(surface.vertices.size());

  mesh.positions.reserve(surface.vertices.size());
  for (const Eigen::Vector3d& vertex : surface.vertices) {
    mesh.positions.push_back((vertex - mesh.origin).cast<float>());
    CHECK(mesh.positions.back().allFinite()) << surface.object_name;
  }
  mesh.box = Eigen::AlignedBox3f(mesh.positions.front());
  for (const Eigen::Vector3f& position : mesh.positions) mesh.box.extend(position);

  std::vector<Eigen::Vector3d> areas(surface.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& [a, b, c] : surface.triangles) {
    const Eigen::Vector3d area = (surface.vertices[b] - surface.vertices[a])
                                     .cross(surface.vertices[c] - surface.vertices[a]);
    for (const uint32_t corner : {a, b, c}) areas[corner] += area;
  }
  mesh.normals.reserve(areas.size());
  for (const Eigen::Vector3d& area : areas) {
    const double length = area.norm();
    mesh.normals.emplace_back(Eigen::Vector3f::UnitZ());
    if (length > 0) mesh.normals.back() = (area / length).cast<float>();
  }
  return mesh;
}

float LinearLight(uint8_t display_value) { return LinearFromDisplay(display_value / 255.f); }

}  // namespace semfoam
