// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// Returns a box (normalised frame) that holds what photos show of an object, to cut its surface at:
// walls, floors and whole scenes have a few huge cells at their ends and behind them, which reach
// far beyond it. Per axis it is the range of the photographed cells' sites without the outermost
// 1 % on either side, wider by a tenth of itself (at least by the median radius); and without a
// limit on a side where no cell of the object lies farther out than by a quarter of the range, so
// that things that end by themselves stay whole. Without photographed cells it has no limits.
Eigen::AlignedBox3d SurfaceBox(const ExportableScene& scene, const std::vector<uint32_t>& cells);

// Returns the box without limits.
Eigen::AlignedBox3d WholeSpace();

// Returns the cells whose sites are in the box, in order.
std::vector<uint32_t> CellsInBox(const ExportableScene& scene,
                                 const std::vector<uint32_t>& cells,
                                 const Eigen::AlignedBox3d& box);

}  // namespace semfoam
