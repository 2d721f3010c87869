// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/segment/surface_graph.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Region of nodes outside of all regions.
inline constexpr int32_t kNoRegion = -1;

// Cuts a part of the surface, the nodes for which `is_in` [nodes] is set, along its concave
// creases: where one thing stands on another or leans against it, the surface turns inwards, while
// a single thing is mostly convex. Returns the region of each node, [nodes], numbered from 0 by
// their lowest nodes; kNoRegion outside of the part.
//
// 1. Patches: nodes around evenly spread seeds, up to about five cells from them, on ways that
//    avoid turns of the normal, creases above all, and changes of colour (as superpixels in a
//    photo).
// 2. Neighbouring patches join, the pair with the least mean concavity first, until that of every
//    pair is above `most_concave`. The concavity of a face between patches with the mean sites x
//    and normals n is (n_1 - n_2) . (x_2 - x_1) / |x_2 - x_1|, 0 on a plane, twice the sine of half
//    the angle in a valley; a pair of regions has the mean over its faces.
// 3. Regions with less than `least_weight` join the neighbour with the longest, least concave
//    border.
//
// (Cf. Stein, Schoeler, Papon and Wörgötter: Object partitioning using local convexity, CVPR 2014,
// who cut at each concave border; the mean over growing borders is steadier on rough surfaces.) The
// result depends on the input alone.
std::vector<int32_t> CutAtCreases(const SurfaceGraph& graph,
                                  const std::vector<uint8_t>& is_in,
                                  double most_concave,
                                  double least_weight);

}  // namespace semfoam
