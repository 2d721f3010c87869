// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_options.h"

#include <filesystem>

namespace semfoam {

// Where scene->mask_path names masks that a training does not read as they are (any format of
// plugin/mask_import other than PNGs of ids named as the photos), converts them into `folder`,
// which is emptied before, logs what was found, and sets scene->mask_path to it. Ids that mean
// nothing from photo to photo make scene->mask_consistency kIndependent, where it is kAuto. Does
// nothing without masks, and for paths about which the training itself complains. Throws UserError
// as ImportMasks does.
void ImportMasksOf(SceneOptions* scene, const std::filesystem::path& folder);

}  // namespace semfoam
