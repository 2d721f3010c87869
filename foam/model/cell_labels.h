// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// What every real cell is, read off the foam's parameters.
struct CellLabels {
  std::vector<int32_t>
      class_index;  // [N] argmax of the classifier on the cell's own identity; -1 without semantics
  std::vector<float> confidence;  // [N] softmax of that class, 0..1; 0 without semantics
  std::vector<uint8_t>
      solid;  // [N] 1 where density * cell radius >= the threshold: matter, not air
};

// Solid: density times cell radius, both of the normalised frame, at least this. A cell alone need
// not be opaque (here some 20 % across): a trained surface is several cells thick. With 0.5 thin
// things fell apart and shells leaked (export/README.md).
inline constexpr float kSolidOpticalDepth = 0.1f;

CellLabels LabelCells(const Foam& foam,
                      const Delaunay& delaunay,
                      float solid_optical_depth = kSolidOpticalDepth);

}  // namespace semfoam
