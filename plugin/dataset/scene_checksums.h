// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_plan.h"

#include <string>

namespace semfoam {

// What a training is made from, as checksums (XXH64, 16 hexadecimal digits) that stay the same as
// long as it does, wherever the files lie. What training does not look at does not count: photos
// that the model does not have, masks without a photo, the format of the model.
struct SceneChecksums {
  std::string model;   // cameras, poses, points and their tracks, names and held-out photos
  std::string photos;  // the files of the photos, in the views' order
  std::string masks;   // the files of their masks, and of the labels' names
};

// Reads all files, in parallel. Throws UserError naming one that cannot be read.
SceneChecksums ChecksumsOf(const ScenePlan& plan);

}  // namespace semfoam
