// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The unchecked content of a mesh file.
struct PolygonSoup {
  // May be not finite.
  std::vector<Eigen::Vector3d> vertices;
  // Corners; SIZE_MAX for a text that is no index of a vertex.
  std::vector<std::vector<size_t>> faces;
};

}  // namespace semfoam
