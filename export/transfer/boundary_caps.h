// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/polygon_mesh.h"

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Closes one boundary loop of a part of a mesh.
struct BoundaryCap {
  uint32_t part = 0;
  // A face of the part beside it.
  uint32_t face = 0;
  // The vertices of the loop, so ordered that the cap, as they go round, continues the orientation
  // of the part's faces; at least 3, each once.
  std::vector<uint32_t> loop;

  // A loop of three vertices is closed by a triangle, a longer one by a fan of triangles about a
  // new vertex, the mean of the loop's.
  bool HasCenter() const { return loop.size() > 3; }
  Eigen::Vector3d Center(const PolygonMesh& mesh) const;
  size_t NumTriangles() const { return HasCenter() ? loop.size() : 1; }
};

// Finds the boundary loops of the parts of a mesh: edges that the faces of a part pass more often
// in one direction than in the other. part_of_face: [faces], `num_parts` for those of no part.
// Parts of a closed, oriented mesh are closed by the caps, those of any other as far as their
// boundaries are loops. By ascending part; the same mesh has the same caps.
std::vector<BoundaryCap> FindBoundaryCaps(const PolygonMesh& mesh,
                                          const std::vector<uint32_t>& part_of_face,
                                          uint32_t num_parts);

}  // namespace semfoam
