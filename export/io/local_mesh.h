// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// A surface for viewers: in float, relative to its own origin, so that a scene at UTM coordinates
// keeps millimetre precision. A vertex of the surface lies at origin + position.
struct LocalMesh {
  // Mean of the vertices.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> positions;
  // Unit normals: the mean of the normals of the faces that meet in the vertex, weighted by their
  // areas. If these have no area, an arbitrary unit vector.
  std::vector<Eigen::Vector3f> normals;
  // Box of the positions; without any, the point 0.
  Eigen::AlignedBox3f box{Eigen::Vector3f(Eigen::Vector3f::Zero())};
};

LocalMesh MakeLocalMesh(const ObjectSurface& surface);

// Converts a display value to linear light, 0..1.
float LinearLight(uint8_t display_value);

}  // namespace semfoam
