// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Spreads labels where few photos have masks. What no masked photo sees is labelled by nothing but
// the total variation, which ends at any cell that once saw a wrong gradient: half of a floor took
// the wall's label.
//
// The identities of such cells are the harmonic extension, over the Voronoi graph, of those that
// masks have taught (random walker segmentation: Grady, "Random Walks for Image Segmentation",
// 2006). An edge conducts by its face's area over its length where both of its cells are matter,
// less where their colours differ, and next to nothing through air. A cell that labelled pixels
// show is held to its trained identity in proportion to the sum of its weights in these.

// Returns whether less than half of the views that are not held out, but one at least, have labels.
bool FewViewsHaveLabels(const TrainingViews& views);

// Replaces identities [N][kIdentityDim] of `foam`. `delaunay` is the triangulation of its sites and
// the guards, `statistics` and `labelled` are those of MeasureCells. Changes nothing where no cell
// is labelled. Returns how many cells have another class than before. The result does not depend
// on the number of threads.
int64_t SpreadLabels(const Delaunay& delaunay,
                     const CellStatistics& statistics,
                     const std::vector<float>& labelled,
                     Foam* foam);

}  // namespace semfoam
