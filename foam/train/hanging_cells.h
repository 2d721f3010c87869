// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/foam.h"
#include "foam/optim/training_topology.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Some cells hang before cameras. Where a photo shows something plain, a large cell of its colour
// anywhere on the way there explains the photo as well as the wall behind it, and where no other
// photo looks through that space nothing speaks against it; a new view then has a grey polygon in
// its corner. Such a cell is not needed: behind it, the photos that show it have what other photos
// have seen there, in the same colour.

// A ray shows the cell that has more than half of its weight. A cell that a ray shows is large
// there if its radius (CellRadii) is more than this share of its distance, 17 pixels of a photo of
// 640. Surfaces that photos have seen in detail have smaller cells.
inline constexpr float kLargeRadius = 0.03f;
// Root of the mean square, over the channels, by which the colours of the rays that show a cell may
// change where it is taken away: walls behind are lit a little differently. The foam's own colours
// are compared, which are the photos' by then, so that no photo is read again.
inline constexpr float kHarmlessChange = 0.12f;
// What so many photos show is there: a cell that so many show from near does not hang, and clearing
// is harmless only before what so many show.
inline constexpr int kFewestWitnesses = 3;
// A ray shows a cell from near if it enters it before this share of the median distance of the
// cells that are not large in its photo. From afar, a hanging cell may pass for a wall.
inline constexpr float kNearShare = 0.7f;
// Least share of the rays showing a cell from near behind which there is a gap, wider than its
// radius, and then a cell with enough witnesses.
inline constexpr float kLeastGapShare = 0.7f;
// Least number of such rays.
inline constexpr int kFewestJudgingRays = 4;

// Rays are cast in a grid with so many along the longer side of a photo, of so many photos, evenly
// chosen, at most.
inline constexpr int kJudgingRaysAlongSide = 80;
inline constexpr int kMostJudgingViews = 256;

// Returns the large cells that hang before cameras, ascending: those that one or two training views
// show from near, and that may be made transparent without harm to what training views show. Of
// adjoining large cells on a ray the first is judged by what is behind the last. Held-out views
// take no part. The result does not depend on the number of threads.
std::vector<uint32_t> FindHangingCells(const Foam& foam,
                                       const TrainingTopology& topology,
                                       const TrainingViews& views);

}  // namespace semfoam
