// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// A surface as viewers take it: in float, near an origin of its own, so that a scene at UTM
// coordinates keeps its millimetres. A vertex of the surface lies at origin + position.
struct LocalMesh {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // the vertices' mean
  std::vector<Eigen::Vector3f> positions;
  // Of length 1: the mean of the faces that meet in the vertex, weighted by their areas. Where
  // those have no area, a normal of length 1 all the same.
  std::vector<Eigen::Vector3f> normals;
  // Of the positions; without any, the origin alone.
  Eigen::AlignedBox3f box{Eigen::Vector3f(Eigen::Vector3f::Zero())};
};

LocalMesh MakeLocalMesh(const ObjectSurface& surface);

// A display value as linear light, 0..1.
float LinearLight(uint8_t display_value);

}  // namespace semfoam
