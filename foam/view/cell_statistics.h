// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/foam.h"
#include "foam/view/view_renderer.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Casts every `stride`-th pixel, in x and y, of all views that are not held out, and measures for
// each cell the largest weight, the weight-averaged visible colour, and how much light passes and
// is stopped (CellStatistics). A cell that no ray meets has zeros and the colour of its constant SH
// term. Unless null, writes to `labelled` [N] the sum of each cell's weights in the pixels that have
// a class.
CellStatistics MeasureCells(const Foam& foam,
                            const ViewRenderer& renderer,
                            const TrainingViews& views,
                            int stride,
                            std::vector<float>* labelled = nullptr);

// Returns the memory that MeasureCells takes for `num_sites` sites, in bytes, without its result.
int64_t CellStatisticsBytes(int64_t num_sites);

}  // namespace semfoam
