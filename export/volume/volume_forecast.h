// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/volume/volume_options.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Checks before the training whether the volumes can fit: returns one sentence that begins with the
// option if they cannot, or an empty string if they may. `points` (world units, the COLMAP frame)
// are SfM points on the scene. `files_scale` is the scale of the files (ExportTransform).
//
// A lower bound, of the box that holds the middle 80 % of the points along each axis (of those
// within options.crop): along its longest edge there are no more voxels than a grid has indices;
// and unless the options name objects, which may be small, a sheet as large as its narrowest long
// side holds no more voxels than options.max_voxels. Returns an empty string for fewer than 100
// points. CheckVolumeSize is exact, but needs the foam.
std::string VoxelsThatCannotFit(const std::vector<Eigen::Vector3d>& points,
                                double files_scale,
                                const VolumeExportOptions& options);

}  // namespace semfoam
