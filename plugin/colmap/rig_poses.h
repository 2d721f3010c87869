// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <filesystem>

namespace semfoam {

// Checks the rigs and frames of a model against its images. Since 3.12 COLMAP derives the pose of
// an image from its frame and its camera's pose on the rig, cam_from_world = sensor_from_rig *
// rig_from_world, and also writes the product into the images' file, for older readers. Both must
// agree.
//
// Throws UserError, one sentence naming the file, where they do not: rigs without frames or frames
// without rigs; an image without a frame, in two, or by another camera than that of its frame; a
// camera that the frame's rig does not have; poses that differ by more than 1e-5 (the Frobenius
// norm of the rotations' difference; the translations', of their lengths), as other programs round
// them. Ignores images that a frame names and the model does not have, because COLMAP may have left
// them out, and cameras without a pose on their rig. Paths are for messages.
void CheckRigPoses(const Reconstruction& reconstruction,
                   const std::filesystem::path& rigs_file,
                   const std::filesystem::path& frames_file,
                   const std::filesystem::path& images_file);

}  // namespace semfoam
