// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// What is known of a cell when an object looks for its inside.
enum class CellKnowledge : uint8_t {
  kOpen,    // seen to be empty, or another thing's: never inside
  kUnseen,  // nobody has looked in: inside or not, as the surface is smaller
  kInside,  // the object's own matter
};

// The unseen cells that belong to an object: of all ways to draw its boundary through space that
// nobody has seen, the one of the smallest area. So the shell that photos show becomes a body:
// where it stands on something, the hole is closed by the smaller of the two, the area of contact
// and not the wall of the hollow; and behind a wall or under a floor, where all is unseen, the
// boundary stays at the wall. Of several equally small boundaries, the one that encloses the least.
//
// A minimum cut: `knowledge` says of every cell [num_cells] (guards are open, whatever it says) on
// which side it is, `face_areas` (aligned with delaunay.neighbors, FaceAreas) what a boundary
// between two cells costs. `inside` lists the cells that are kInside. Ascending; the same on every
// machine, as areas are counted in integers.
std::vector<uint32_t> UnseenInside(const Delaunay& delaunay,
                                   const std::vector<double>& face_areas,
                                   const std::vector<CellKnowledge>& knowledge,
                                   const std::vector<uint32_t>& inside);

}  // namespace semfoam
