// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Cells of an object, without the pits and thin tunnels that training left.
struct CleanCells {
  // Ascending.
  std::vector<uint32_t> cells;
  // Number of cells added to fill pits.
  int64_t pits = 0;
  // Number of tunnels that are gone: by how much the genus of the boundary is lower.
  int64_t tunnels = 0;
};

// Whether photos look through a cell and show it to be clear: seen, with a density times radius
// below 0.01.
bool IsClearAir(const ExportableScene& scene, uint32_t cell);

// Fills pits and closes tunnels that are no wider than the cells around them, which are left where
// training took single cells of a wall for air, or of air for matter. Adds no cell of another
// object, none that is more than twice as large as the cells around it, and none that is clear
// (IsClearAir). `cells` must be ascending.
//
// - A pit is a cell with more than 62 % of its neighbours in the object, each by the inverse of its
//   distance.
// - A tunnel is plugged by adding one or two cells, or the bridge beside it is cut by removing one
//   or two, whichever changes less volume. Wider tunnels stay, such as a mug's handle, and so do
//   handles of one cell that lead a longer way around (more than 8 cells).
//
// Numbers of connected components and of cavities stay. The union of the cells has the homotopy
// type of the subcomplex that their sites induce in the Delaunay triangulation. Adding a cell
// changes its Euler characteristic by 1 - chi(L), where L is the part of the link of its site, a
// sphere, that the object's sites induce; with a components of L and b of its complement in the
// sphere that is b - a (Alexander duality). A cell is added to a pit only if it does not lower the
// characteristic; to a tunnel only if it raises it, and splits neither the object nor the space
// around it, so that the genus falls.
CleanCells FillPitsAndTunnels(const ExportableScene& scene, const std::vector<uint32_t>& cells);

}  // namespace semfoam
