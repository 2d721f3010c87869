// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_plan.h"

#include <cstdint>
#include <string>
#include <vector>

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

// Checksums of the files alone, each 0 where there is none.
struct FileChecksums {
  // [photos]
  std::vector<uint64_t> photos;
  // Of their masks [photos], then of the other files of the masks.
  std::vector<uint64_t> masks;
};

// Reads all files, in parallel; of photos that are not drawn (ScenePlan::IsDrawn), and their masks,
// takes the checksums from `known`, unless it is null or of other files. Throws UserError naming a
// file that cannot be read.
FileChecksums ChecksumsOfFiles(const ScenePlan& plan, const FileChecksums* known = nullptr);

SceneChecksums ChecksumsOf(const ScenePlan& plan, const FileChecksums& files);

}  // namespace semfoam
