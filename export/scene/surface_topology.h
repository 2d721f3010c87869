// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Topology of a closed, oriented 2-manifold of triangles.
struct SurfaceTopology {
  // Number of connected components.
  int64_t shells = 0;
  // Number of tunnels (handles) of all shells together: the sum of (2 - chi) / 2, where chi is the
  // Euler characteristic of a shell, vertices - edges + triangles. 0 for balls, 1 for a torus.
  int64_t genus = 0;
};

// Computes the topology. `triangles` hold indices below `num_vertices`, each of which must be used
// (CHECK). The surface must be a closed 2-manifold, which is not checked.
SurfaceTopology TopologyOf(size_t num_vertices,
                           const std::vector<std::array<uint32_t, 3>>& triangles);

// Returns the number of shells that bound inner cavities, for a surface that is the whole boundary
// of a body of `components` connected components. Every shell has one component, or the outside, or
// a cavity on either side, and these form a tree whose links are the shells: so there are as many
// shells as components and cavities together.
int64_t NumCavities(const SurfaceTopology& topology, int64_t components);

// Returns a text such as "9 shells, 8 of them cavities, genus 1" or "1 shell, no cavities, genus
// 0".
std::string TopologySummary(const SurfaceTopology& topology, int64_t components);

}  // namespace semfoam
