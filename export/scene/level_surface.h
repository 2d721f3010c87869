// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/frame_choice.h"
#include "foam/geometry/plane_fit.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Returns samples, in the COLMAP frame, of the surface that a frame is levelled by: of all matter
// (LevelBy::kPlane), or of the objects of labels (kLabels). A sample stands for a cell next to
// empty space that photos look through (next to any cell that is no matter, in models without
// CellStatistics::passed): the mean of the middles between its site and those of its empty
// neighbours, weighted by the areas of the faces to them. The area of the faces is its weight, up
// to four times the median; the tolerance is twice the median radius of these cells.
//
// Throws UserError where the labels have no object (FilterObjects), and FieldError where there are
// less than ten samples. CHECKs that the choice asks for a surface.
SurfaceSamples LevelSurface(const ExportableScene& scene, const LevelChoice& level);

// Returns the SfM points of a COLMAP model as samples, without those that are not finite. All have
// the same weight; the tolerance is a hundredth of their median distance from their middle. Throws
// FieldError where the choice is of labels, which these points do not have, and where there are
// less than ten of them.
SurfaceSamples LevelSurface(const std::vector<Eigen::Vector3d>& points, const LevelChoice& level);

}  // namespace semfoam
