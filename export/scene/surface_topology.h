// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// What a closed, oriented 2-manifold of triangles is made of.
struct SurfaceTopology {
  int64_t shells = 0;  // connected components
  // Tunnels (handles) of all shells together: the sum of (2 - chi) / 2, where chi is the Euler
  // characteristic of a shell, vertices - edges + triangles. 0 for balls, 1 for a torus.
  int64_t genus = 0;
};

// `triangles` hold indices below `num_vertices`, each of which is used (CHECK). The surface must be
// a closed 2-manifold; what else it is, is not looked at.
SurfaceTopology TopologyOf(size_t num_vertices,
                           const std::vector<std::array<uint32_t, 3>>& triangles);

// The shells that are walls of inner cavities, where the surface is the whole boundary of a body of
// so many connected components. Every shell has one component, or the outside, or a cavity on
// either side, and these form a tree whose links are the shells: so there are as many shells as
// components and cavities together.
int64_t NumCavities(const SurfaceTopology& topology, int64_t components);

// "9 shells, 8 of them cavities, genus 1"; "1 shell, no cavities, genus 0".
std::string TopologySummary(const SurfaceTopology& topology, int64_t components);

}  // namespace semfoam
