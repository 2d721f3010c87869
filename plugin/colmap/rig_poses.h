// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <filesystem>

namespace semfoam {

// Since 3.12 COLMAP places an image by its frame and its camera's place on the rig,
// cam_from_world = sensor_from_rig * rig_from_world, and writes the product into the images' file,
// for older readers. Both must say the same.
//
// Throws UserError, one sentence naming the file, where they do not: rigs without frames or frames
// without rigs; an image without a frame, in two, or by another camera than its frame says; a
// camera that the frame's rig does not have; poses that differ by more than 1e-5 (the Frobenius
// norm of the rotations' difference; the translations', of their lengths), as other programs round
// them. Images that a frame names and the model does not have are none of it: COLMAP may have left
// them out. So are cameras without a place on their rig. Paths are for messages.
void CheckRigPoses(const Reconstruction& reconstruction,
                   const std::filesystem::path& rigs_file,
                   const std::filesystem::path& frames_file,
                   const std::filesystem::path& images_file);

}  // namespace semfoam
