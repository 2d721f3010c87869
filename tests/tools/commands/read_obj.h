// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/program.h"
#include <Eigen/Core>

namespace semfoam {

// The positions of a Wavefront OBJ's vertices, in its order.
inline std::vector<Eigen::Vector3d> ObjVertices(const std::filesystem::path& path) {
  std::istringstream lines(ReadFile(path));
  std::vector<Eigen::Vector3d> vertices;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    if (!(words >> kind) || kind != "v") continue;
    Eigen::Vector3d& v = vertices.emplace_back();
    words >> v.x() >> v.y() >> v.z();
  }
  return vertices;
}

}  // namespace semfoam
