// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

inline constexpr uint32_t kNoCell = 0xffffffffu;
inline constexpr uint32_t kNoTet = 0xffffffffu;

// The Delaunay triangulation of all cells (sites, then guards), the dual of the foam. Cells i and j
// are neighbours when they share a Delaunay edge; CGAL perturbs symbolically, so this is a valid
// simplicial complex even for cospherical sites.
struct Delaunay {
  // Number of real sites: cells [0, num_sites).
  uint32_t num_sites = 0;
  // Number of sites and guards: the guards are cells [num_sites, num_cells).
  uint32_t num_cells = 0;

  // CSR: the neighbours of cell i are neighbors[offsets[i]] .. neighbors[offsets[i + 1]],
  // ascending. A site at exactly the place of one with a lower index has an empty cell and no
  // neighbours.
  std::vector<uint32_t> offsets;    // [num_cells + 1]
  std::vector<uint32_t> neighbors;  // [2 E]

  // Finite tetrahedra, positively oriented: det(v1 - v0, v2 - v0, v3 - v0) > 0. tet_neighbors[t][k]
  // is the tetrahedron on the other side of the facet opposite to vertex k, or kNoTet on the hull.
  // No real site is on the hull, so every tetrahedron around a real site is here.
  std::vector<std::array<uint32_t, 4>> tets;
  std::vector<std::array<uint32_t, 4>> tet_neighbors;

  std::span<const uint32_t> Neighbors(uint32_t cell) const {
    return {neighbors.data() + offsets[cell], neighbors.data() + offsets[cell + 1]};
  }
};

// Triangulates `cell_positions` = WithGuardSites(sites), in double and with exact predicates (CGAL,
// EPICK, sequential, so that the result depends on the input alone). The tetrahedra are numbered in
// an order that depends on the input alone too. CHECKs that every coordinate is finite.
Delaunay Triangulate(const std::vector<Eigen::Vector3f>& cell_positions);

// The tetrahedra around every cell. Their circumcentres are the corners of that cell.
struct TetsOfCells {
  // CSR: those around cell i are tets[offsets[i]] .. tets[offsets[i + 1]], ascending.
  std::vector<uint32_t> offsets;  // [num_cells + 1]
  std::vector<uint32_t> tets;     // [4 * delaunay.tets.size()]

  std::span<const uint32_t> Of(uint32_t cell) const {
    return {tets.data() + offsets[cell], tets.data() + offsets[cell + 1]};
  }
};
TetsOfCells ListTetsOfCells(const Delaunay& delaunay);

// Returns a permutation that puts sites in Hilbert order: position k of the new order holds site
// order[k] of the old.
std::vector<uint32_t> HilbertOrder(const std::vector<Eigen::Vector3f>& sites);

// Returns the cell whose site is nearest to `query` (ties: the one found first), by greedy descent
// over the Delaunay graph from `start`. The graph has no local minima, so the descent reaches the
// nearest site.
uint32_t NearestCell(const std::vector<Eigen::Vector3f>& cell_positions,
                     const Delaunay& delaunay,
                     const Eigen::Vector3d& query,
                     uint32_t start);

}  // namespace semfoam
