// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/surface/contact_planes.h"
#include "export/surface/surface_box.h"

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// Returns the cells of an object with a boundary of less area: fills pits and cuts tufts, where
// training took cells of a wall for air, or of air for matter. `cells` and the result ascend.
//
// Of all sets of cells it is the one with the least sum of the area of its boundary and of what its
// changes cost, a minimum cut over the cells up to three steps around the boundary and all cells
// within. To change sides costs a share of the area of the cell's own faces, which grows with the
// light that has looked at it (ExportableScene: passed, stopped): most for matter that photos show,
// so that leaves and walls of one cell stay, and for clear air, little for what no photo knows.
// Hollows that few photos look into hold haze in large cells, which is solid but lets nearly all
// light pass before it meets a surface: there the change is a gain, so cups and gaps are open; but
// not without `opens_hollows`, for whole scenes, whose cells are as large as they are far off.
//
// Near the planes of `contacts` labels and densities are chance, so changes cost little there,
// hidden cells of the supporting object may be taken, and faces towards cells beyond a plane count
// nothing: the boundary meets it at a right angle. Else no cell of another object is added.
//
// Cells whose sites are out of the `box` (normalised frame), at which the surface is cut, are never
// added, and faces towards them count nothing.
//
// Without figures of the rays (ExportableScene::passed) the cells are returned as they are, and so
// is an object that would lose half of its cells: a few cells, thin on what they lie on, have more
// boundary than evidence. The same on every machine, because costs are counted in whole numbers.
std::vector<uint32_t> CutBoundary(const ExportableScene& scene,
                                  const std::vector<ContactPlane>& contacts,
                                  const std::vector<uint32_t>& cells,
                                  const Eigen::AlignedBox3d& box = WholeSpace(),
                                  bool opens_hollows = true);

}  // namespace semfoam
