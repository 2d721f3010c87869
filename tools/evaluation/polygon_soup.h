// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What a mesh's file holds, before anything of it is believed.
struct PolygonSoup {
  std::vector<Eigen::Vector3d> vertices;   // also not finite
  std::vector<std::vector<size_t>> faces;  // corners; SIZE_MAX for what is no number of a vertex
};

}  // namespace semfoam
