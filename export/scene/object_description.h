// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Of a closed surface, in the frame of its vertices.
struct SurfaceIntegrals {
  double area = 0;
  // Centroid of what it encloses.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
};

// Integrates over a closed surface of at least one triangle, counter-clockwise seen from outside.
SurfaceIntegrals IntegrateSurface(const std::vector<Eigen::Vector3d>& vertices,
                                  const std::vector<std::array<uint32_t, 3>>& triangles);

// Measures an object by its cells: volume, surface area, centroid, bounding box, confidence,
// cavities and genus of ObjectInfo, whose components must be counted already. The area and the
// centroid are those of the closed surface of ExtractSurface, the latter by the divergence theorem,
// so both are exact for the union of the object's cells.
void DescribeObject(const ExportableScene& scene, ObjectInfo* object);

}  // namespace semfoam
