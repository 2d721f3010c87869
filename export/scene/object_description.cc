// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_description.h"

#include "export/scene/object_surface.h"
#include "export/scene/surface_topology.h"

#include <Eigen/Geometry>

namespace semfoam {
SurfaceIntegrals IntegrateSurface(const std::vector<Eigen::Vector3d>& vertices,
                                  const std::vector<std::array<uint32_t, 3>>& triangles) {
  SurfaceIntegrals integrals;
  // Tetrahedra from one corner of the surface to every triangle; their signed volumes add up to
  // what it encloses.
  const Eigen::Vector3d& apex = vertices[0];
  double six_volumes = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // relative to the apex
  for (const auto& [i, j, k] : triangles) {
    const Eigen::Vector3d a = vertices[i] - apex, b = vertices[j] - apex, c = vertices[k] - apex;
    integrals.area += 0.5 * (b - a).cross(c - a).norm();
    const double six_volume = a.dot(b.cross(c));
    six_volumes += six_volume;
    moment += six_volume / 4 * (a + b + c);
  }
  integrals.centroid = apex;
  if (six_volumes > 0) integrals.centroid += moment / six_volumes;
  return integrals;
}

void DescribeObject(const ExportableScene& scene, ObjectInfo* object) {
  const double scale = scene.world_from_normalized.scale;
  double confidence = 0;
  int64_t of_own_class = 0;
  for (const uint32_t cell : object->cells) {
    object->volume += scene.volume[cell];
    if (scene.label_id[cell] == object->id) {
      confidence += scene.labels.confidence[cell];
      ++of_own_class;
    }
    for (const uint32_t tet : scene.tets_of_cells.Of(cell)) {
      object->bounding_box.extend(scene.FileFromNormalized(scene.voronoi_vertices[tet]));
    }
  }
  object->volume *= scale * scale * scale;
  object->confidence = confidence / static_cast<double>(of_own_class);
  const ObjectSurface surface = ExtractSurface(scene, *object);
  const SurfaceTopology topology = TopologyOf(surface.vertices.size(), surface.triangles);
  object->cavities = NumCavities(topology, object->components);
  object->genus = topology.genus;
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(surface.vertex_tet.size());
  for (const uint32_t tet : surface.vertex_tet) vertices.push_back(scene.voronoi_vertices[tet]);
  const SurfaceIntegrals integrals = IntegrateSurface(vertices, surface.triangles);
  object->area = integrals.area * scale * scale;
  object->centroid = scene.FileFromNormalized(integrals.centroid);
}

}  // namespace semfoam
