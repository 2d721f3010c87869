// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/view/cell_statistics.h"

#include <cstdint>

namespace semfoam {

// Some cells are hidden: they lie in the pictures of photos, but others are before them. A new view
// may see them past the outline of a thing. What little light some of them send to photos makes up
// for errors of what is before them, so that they may have any colour: brown polygons hang in the
// white around a wooden tankard. Cells that no ray meets have no reason to be opaque either: new
// views look through them into the white behind the scene.

// A cell is hidden that shows in less than this share of the rays that could meet it
// (CellMeasurements: weight, potential_rays). Cells of surfaces show in some 0.1.
inline constexpr float kHiddenShare = 0.002f;
// A cell that shows in less than this share may keep its colour, which photos have told, but gets
// the identity of cells that show in more: masks tell little about what a cell that shows so little
// belongs to, and a wrong label is seen wherever the cell is.
inline constexpr float kHiddenIdentityShare = 0.005f;
// Fewest rays by which a cell can be told to be hidden: smaller cells may lie between the rays that
// were cast.
inline constexpr float kFewestPotentialRays = 4;
// A cell that no ray reaches with more of its light than this is unseen.
inline constexpr float kUnseenTransmittance = 0.01f;
// Optical depth of a filled cell over its radius.
inline constexpr float kFilledOpticalDepth = 5;

struct HiddenCellChanges {
  // Hidden opaque cells that have the colours of their neighbours now.
  int64_t recolored = 0;
  // Unseen cells that views show as opaque now.
  int64_t filled = 0;
};

// Gives hidden cells what is most likely there. Hidden opaque cells (CellOpacity), and those that
// are filled, get one colour in all directions, and an identity: the harmonic extensions, over the
// Voronoi graph, of the mean colours and the identities of the opaque cells that are not hidden
// (kHiddenShare for colours, kHiddenIdentityShare for identities). These pass through hidden cells
// whether opaque or not. Cells outside of all photos are as if they were hidden. Also writes the
// colour to the cell's `statistics.mean_color`. Cells in the picture of a photo that are unseen are
// filled: they get a Foam::assumed_density. Trained densities stay, and so does a cell from which
// no way leads to a seen one.
//
// `delaunay` is the triangulation of the sites and the guards, and `measured` what MeasureCells
// returned. The result does not depend on the number of threads.
HiddenCellChanges CompleteHiddenCells(const Delaunay& delaunay,
                                      CellMeasurements* measured,
                                      Foam* foam);

}  // namespace semfoam
