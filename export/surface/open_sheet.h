// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <cstdint>

namespace semfoam {

// Returns the part of a closed surface that photos show, as a sheet with a rim: walls, floors and
// surroundings have a back only because surfaces of cells are closed. Faces keep their order,
// vertices too.
//
// - A face is shown if at least two of its corners are. Hidden patches with less than a thousandth
//   of the shown area stay, so that the sheet has no small holes, and so small shown pieces go.
// - At the rim faces go that have a side more than fifteen times as long as the median of the
//   sheet's, one after the other: they reach out to where nothing is known.
//
// The result is an oriented 2-manifold with boundary: where two fans of faces meet in one vertex
// only, each gets a copy of it. Empty where nothing is shown. CHECKs that the surface has
// vertex_shown.
ObjectSurface OpenSheet(const ObjectSurface& surface);

// Numbers of connected pieces of a sheet and of its rims, closed lines of sides with one face.
struct SheetTopology {
  int64_t pieces = 0;
  int64_t rims = 0;
};
SheetTopology TopologyOfSheet(const ObjectSurface& sheet);

}  // namespace semfoam
