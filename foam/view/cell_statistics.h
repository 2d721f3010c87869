// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/foam.h"
#include "foam/util/ids.h"
#include "foam/view/view_renderer.h"

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What the views that are not held out see of the cells.
struct CellMeasurements {
  CellStatistics statistics;
  // [N], 0 to 1: the largest transmittance of a ray where it enters the cell, of the cells that
  // pass, stop or show something; else 0.
  std::vector<float> transmittance;
  // [N] Sum over the rays of the cell's rendering weight.
  std::vector<float> weight;
  // [N] How many rays would meet a ball of the cell's radius (CellRadii) around its site, were
  // nothing before it.
  std::vector<float> potential_rays;
};

// Whether a ray is cast. Empty: all are.
using RayFilter =
    std::function<bool(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction)>;

// Casts every `stride`-th pixel, in x and y, of all views that are not held out, if `casts` it, and
// measures for each cell the largest weight, the weight-averaged visible colour, how much light
// passes and is stopped (CellStatistics), how much arrives, and how many rays show it of those that
// could. A cell that no ray meets has zeros and the colour of its constant SH term.
CellMeasurements MeasureCells(const Foam& foam,
                              const ViewRenderer& renderer,
                              const TrainingViews& views,
                              int stride,
                              const RayFilter& casts = {});

// How much of a class the masks show in a cell.
struct LabelVote {
  uint32_t cell = 0;
  ClassIndex class_index{0};
  // Sum over the class's pixels of the cell's rendering weight, where it is kLeastVote or more.
  float weight = 0;
};

// Casts every `stride`-th pixel, in x and y, of the views that have labels and are not held out.
// Returns the votes of their pixels, one for each cell and class, by cell, then class. The result
// does not depend on the number of threads. Throws what TrainingViews::OpenView throws.
std::vector<LabelVote> MeasureLabels(const Foam& foam,
                                     const ViewRenderer& renderer,
                                     const TrainingViews& views,
                                     int stride);

// Returns the memory that MeasureCells takes for `num_sites` sites, in bytes, without its result.
int64_t CellStatisticsBytes(int64_t num_sites);

}  // namespace semfoam
