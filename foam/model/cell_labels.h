// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/util/ids.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace semfoam {

// Class and solidity of every cell, guards apart.
struct CellLabels {
  // [N] Argmax of the classifier on the cell's own identity; kUnlabelled without semantics.
  std::vector<ClassIndex> class_index;
  // [N] Softmax of that class, 0 to 1; 0 without semantics.
  std::vector<float> confidence;
  // [N] 1 where density * cell radius is at least the threshold: matter, not air. Sky is none
  // (IsSkySite).
  std::vector<uint8_t> solid;
};

// Threshold of density times cell radius, both in the normalised frame, from which on a cell is
// solid. A single cell need not be opaque (at this value it is so by some 20 %), as a trained
// surface is several cells thick. With 0.5 thin things fell apart and shells leaked
// (export/README.md).
inline constexpr float kSolidOpticalDepth = 0.1f;

// Computes the labels of all cells. `delaunay` is the triangulation of the foam's sites and the
// guards.
CellLabels LabelCells(const Foam& foam,
                      const Delaunay& delaunay,
                      float solid_optical_depth = kSolidOpticalDepth);

// Returns whether a cell is haze, which stops less than a thirtieth of the light that meets it,
// however dense it is. `passed` and `stopped` must have been measured.
inline bool IsHaze(const CellStatistics& statistics, size_t cell) {
  constexpr float kRatio = 30;
  return statistics.passed[cell] > kRatio * statistics.stopped[cell];
}

}  // namespace semfoam
