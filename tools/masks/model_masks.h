// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/corrected_masks.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// A COLMAP model with the masks of its images, for commands that train nothing.

// Reads the model. Throws UserError where it has no registered image.
Reconstruction ReadRegistered(const std::filesystem::path& model_folder);

// Reads and corrects the masks of the model's images, and logs what they are. Throws UserError as
// PairMasks, RequireMasks and LoadCorrectedPhotos do.
CorrectedPhotos ReadModelMasks(const Reconstruction& model,
                               const std::filesystem::path& mask_folder,
                               LabelZero label_zero,
                               MaskConsistency consistency);

// Returns the labels of the photos, by the names in `labels_file`; warns of names that nothing has.
// `is_given`: the user named that file.
std::vector<Label> NamedLabelsOf(const MaskedPhotos& photos,
                                 const std::filesystem::path& labels_file,
                                 bool is_given);

}  // namespace semfoam
