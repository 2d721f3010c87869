// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/surface_topology.h"

#include <numeric>

#include <glog/logging.h>

namespace semfoam {

SurfaceTopology TopologyOf(size_t num_vertices,
                           const std::vector<std::array<uint32_t, 3>>& triangles) {
  // Union-find over the vertices.
  std::vector<uint32_t> parent(num_vertices);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t vertex) {
    while (parent[vertex] != vertex) {
      parent[vertex] = parent[parent[vertex]];
      vertex = parent[vertex];
    }
    return vertex;
  };
  std::vector<uint8_t> is_used(num_vertices, 0);
  auto shells = static_cast<int64_t>(num_vertices);
  for (const std::array<uint32_t, 3>& triangle : triangles) {
    for (const uint32_t vertex : triangle) {
      CHECK_LT(vertex, num_vertices);
      is_used[vertex] = 1;
      const uint32_t a = root(triangle[0]), b = root(vertex);
      if (a == b) continue;
      parent[b] = a;
      --shells;
    }
  }
  CHECK_EQ(std::accumulate(is_used.begin(), is_used.end(), size_t{0}), num_vertices);
  // Every edge has two triangles and every triangle three edges.
  CHECK_EQ(triangles.size() % 2, 0u) << "the surface is not closed";
  const int64_t euler =
      static_cast<int64_t>(num_vertices) - static_cast<int64_t>(triangles.size() / 2);
  CHECK_EQ(euler % 2, 0) << "the surface is no oriented 2-manifold";
  return {shells, shells - euler / 2};
}

int64_t NumCavities(const SurfaceTopology& topology, int64_t components) {
  CHECK_GE(topology.shells, components);
  return topology.shells - components;
}

std::string TopologySummary(const SurfaceTopology& topology, int64_t components) {
  const int64_t cavities = NumCavities(topology, components);
  return std::to_string(topology.shells) + (topology.shells == 1 ? " shell, " : " shells, ") +
         (cavities == 0 ? "no cavities"
                        : std::to_string(cavities) + " of them " +
                              (cavities == 1 ? "a cavity" : "cavities")) +
         ", genus " + std::to_string(topology.genus);
}

}  // namespace semfoam
