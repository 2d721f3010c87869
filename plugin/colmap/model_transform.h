// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/sim3.h"
#include "plugin/colmap/colmap_model.h"

namespace semfoam {

// Returns the pose of a camera or a rig after the world was transformed: the camera sees the same.
// Its own frame grows with the world.
Pose TransformedPose(const Sim3& target_from_source, const Pose& pose);

// Transforms a COLMAP model, as `colmap model_transformer` does: points, the poses of images and
// frames, and the baselines of rigs. Features, cameras and tracks stay.
void TransformReconstruction(const Sim3& target_from_source, Reconstruction* reconstruction);

}  // namespace semfoam
