// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <cstdint>

namespace semfoam {

// Whether a surface of method `smooth` is one side of something that has no other, such as a wall,
// a floor or a rug, and not of a body: photos look at less than kMostShownOfSheet of its area,
// planes on which it stands aside, and
// - it goes on beyond what photos show (`is_cut`, at SurfaceBox),
// - or kLeastFlatOfSheet of what they look at lies in planes.
// A thing that was photographed from the front only is a body. False where it is not known what
// photos show. CHECKs the sizes of its arrays.
bool IsSheet(const ObjectSurface& surface, bool is_cut);

inline constexpr double kMostShownOfSheet = 0.6;
inline constexpr double kLeastFlatOfSheet = 0.5;

// Returns the part of a closed surface that photos show, as a sheet with a rim: walls, floors and
// surroundings have a back only because surfaces of cells are closed. Faces keep their order,
// vertices too.
//
// - A face is shown if at least two of its corners are, or lie in a plane that photos show (so that
//   a floor goes on below what stands on it). Hidden patches with less than a thousandth of the
//   shown area stay, so that the sheet has no small holes. Shown pieces of less than a hundredth
//   go.
// - At the rim faces go that have a side more than five times (of a whole scene, kNoObject, fifteen
//   times) as long as the median of the sheet's and lie in no such plane, one after the other:
//   cells are large where photos tell no distance.
//
// The result is an oriented 2-manifold with boundary: where two fans of faces meet in one vertex
// only, each gets a copy of it. Empty where nothing is shown. CHECKs that the surface has
// vertex_shown and vertex_flat.
ObjectSurface OpenSheet(const ObjectSurface& surface);

// Numbers of connected pieces of a sheet and of its rims, closed lines of sides with one face.
struct SheetTopology {
  int64_t pieces = 0;
  int64_t rims = 0;
};
SheetTopology TopologyOfSheet(const ObjectSurface& sheet);

}  // namespace semfoam
