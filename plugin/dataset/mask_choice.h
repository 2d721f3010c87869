// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/scene_plan.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Chooses the masks of a scene: in which folder they are, which photo each belongs to, and where
// the names of their labels are.

// Returns the folders in which masks are looked for that the user did not name.
std::vector<std::filesystem::path> WorkspacesOf(const SceneOptions& options);

// Reads the masks' headers, in parallel. Takes the photos of the plan; fills its masks,
// mask_folder, mask_decoding, masks_are_given, labels_file and labels_are_given. Throws as
// PlanScene does of the masks and the labels' names.
void ChooseMasks(const SceneOptions& options, ScenePlan* plan);

}  // namespace semfoam
