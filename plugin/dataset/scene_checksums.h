// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_plan.h"

#include <string>

namespace semfoam {

// Checksums of the input of a training (XXH64, 16 hexadecimal digits), which do not depend on where
// the files lie, nor on what training does not read: photos that the model does not have, masks
// without a photo, the format of the model.
struct SceneChecksums {
  // Cameras, poses, points and their tracks, names and held-out photos.
  std::string model;
  // Points of the dense cloud, merged by voxels; the same text wherever there is none.
  std::string seed_cloud;
  // Files of the photos, in the views' order.
  std::string photos;
  // Files of their masks, of the labels' names and of the regions' features.
  std::string masks;
};

// Reads all files, in parallel. Throws UserError naming one that cannot be read.
SceneChecksums ChecksumsOf(const ScenePlan& plan);

}  // namespace semfoam
