// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/volume/volume_options.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Says, before there is a foam, that voxels cannot fit: one sentence that begins with the option,
// or an empty string where they may. `points` (world units, the COLMAP frame) lie on what will be
// exported: SfM points. `files_scale` is how many times as large the files are (ExportTransform).
//
// A lower bound, of the box that holds the middle 80 % of the points along each axis (of those
// within options.crop): along its longest edge there are no more voxels than a grid has indices;
// and unless the options name objects, which may be small, a sheet as large as its narrowest long
// side holds no more voxels than options.max_voxels. Fewer than 100 points tell nothing.
// CheckVolumeSize is exact, and comes when the foam is there.
std::string VoxelsThatCannotFit(const std::vector<Eigen::Vector3d>& points,
                                double files_scale,
                                const VolumeExportOptions& options);

}  // namespace semfoam
