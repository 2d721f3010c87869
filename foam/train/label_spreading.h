// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/train/harmonic_extension.h"
#include "foam/util/ids.h"
#include "foam/view/cell_statistics.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Spreads labels where few photos have masks. There, the identity loss leaves most cells without a
// gradient, and the total variation alone does not carry labels far.
//
// The classes of all cells are computed anew from the votes of the masks: each cell's probabilities
// are the harmonic extension, over the Voronoi graph, of those in the cells that masks show (random
// walker segmentation: Grady, "Random Walks for Image Segmentation", 2006). An edge conducts by its
// face's area over its length where both of its cells are matter, less where their colours differ,
// and next to nothing through air. A cell that masks show is held to its votes in proportion to
// their weight. Then, twice, every cell is held a little to the classes that are likely by the
// labels so spread and by its colour, whose likelihoods are the densities of the classes' colours
// where masks show them ("Multilabel random walker image segmentation using prior models", 2005,
// with the spread labels as the prior), and labels are spread anew.

// Returns whether less than half of the views that are not held out, but one at least, have labels.
bool FewViewsHaveLabels(const TrainingViews& views);

// Returns the edges between sites; those to guards are left out.
ConductanceGraph MakeConductanceGraph(const Delaunay& delaunay,
                                      const CellStatistics& statistics,
                                      const Foam& foam);

using IdentityVector = Eigen::Matrix<float, kIdentityDim, 1>;

// Returns one unit vector for each class, as far from each other as they are easily placed: the
// axes for up to kIdentityDim classes. Identities that are mixtures of these have the class with
// the largest share.
std::vector<IdentityVector> ClassCodes(int num_classes);

struct SpreadingResult {
  // Number of cells that have another class than before.
  int64_t changed_cells = 0;
  // Classes with votes that had less than kFewCells cells: they are smaller than the cells.
  std::vector<ClassIndex> small_classes;
};
inline constexpr int kFewCells = 4;

// Replaces the identities of `foam` and its classifier. `delaunay` is the triangulation of its
// sites and the guards, `statistics` that of MeasureCells, `votes` that of MeasureLabels. A class
// with votes keeps the cell of its greatest vote, so that it never vanishes. Changes nothing
// without votes.
SpreadingResult SpreadLabels(const Delaunay& delaunay,
                             const CellStatistics& statistics,
                             const std::vector<LabelVote>& votes,
                             Foam* foam);

}  // namespace semfoam
