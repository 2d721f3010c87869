// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Classification of a cell for the search of an object's inside.
enum class CellKnowledge : uint8_t {
  // Seen to be empty, or part of another object: never inside.
  kOpen,
  // Not seen by any photo: inside or not, whichever gives the smaller surface.
  kUnseen,
  // Matter of the object.
  kInside,
};

// Returns the unseen cells that belong to an object: of all boundaries through unseen space,
// chooses the one of the smallest area. So the shell that photos show is completed to a body: where
// the object stands on another one, the boundary closes at the area of contact, which is smaller
// than the wall of the hollow inside; and behind a wall or under a floor, where everything is
// unseen, the boundary stays at the wall. Of several equally small boundaries, chooses the one that
// encloses the least.
//
// Computes a minimum cut: `knowledge` [num_cells] gives the side of each cell (guards are always
// open), `face_areas` (aligned with delaunay.neighbors, FaceAreas) the cost of a boundary between
// two cells. `inside` lists the cells that are kInside. The result is ascending, and the same on
// every machine, because areas are counted in integers.
std::vector<uint32_t> UnseenInside(const Delaunay& delaunay,
                                   const std::vector<double>& face_areas,
                                   const std::vector<CellKnowledge>& knowledge,
                                   const std::vector<uint32_t>& inside);

}  // namespace semfoam
