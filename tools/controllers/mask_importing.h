// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_options.h"

#include <filesystem>

namespace semfoam {

// Where scene->mask_path names masks that a training does not read as they are (any format of
// plugin/mask_import other than PNGs of ids named as the photos), converts them into `folder`,
// which is emptied before, logs what was found, and sets scene->mask_path to it. Where
// scene->mask_consistency is kAuto, ids that mean nothing from photo to photo make it kIndependent,
// and masks all of which are grown from marks make it kOff: who marked a thing named it, and where
// a mark has grown over its border, the tracks there would rename the whole region. Does nothing
// without masks, and for paths about which the training itself complains. Throws UserError as
// ImportMasks does.
void ImportMasksOf(SceneOptions* scene, const std::filesystem::path& folder);

}  // namespace semfoam
