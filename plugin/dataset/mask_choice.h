// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/scene_plan.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Chooses the masks of a scene: their folder, the photo of each, and the file with the names of
// their labels.

// Returns the folders that are searched for masks where the user has not named the mask folder.
std::vector<std::filesystem::path> WorkspacesOf(const SceneOptions& options);

// Reads the masks' headers, in parallel. Takes the photos of the plan; fills its masks,
// mask_folder, mask_decoding, masks_are_given, labels_file, labels_are_given and features_file.
// Throws what PlanScene throws about masks and label names.
void ChooseMasks(const SceneOptions& options, ScenePlan* plan);

// Returns the binary masks of ignored pixels in `ignore_path` [photo_names], empty where a photo
// has none, found by the photos' names in all spellings (MatchPhotos). Throws UserError where the
// folder is missing, has no PNG or none of a photo.
std::vector<std::filesystem::path> FindIgnoreFiles(const std::filesystem::path& ignore_path,
                                                   const std::vector<std::string>& photo_names);

// Sets the plan's binary masks of ignored pixels, and throws, as FindIgnoreFiles does.
void ChooseIgnoredPixels(const SceneOptions& options, ScenePlan* plan);

}  // namespace semfoam
