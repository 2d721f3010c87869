// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

namespace semfoam {

// Returns the foam that a training of `reconstruction` without masks would start from: a cell at
// every point (InitialFoam), the cameras of its images, no labels. `model_folder` is for messages.
// Throws UserError where the reconstruction has no image.
Model UntrainedModel(const Reconstruction& reconstruction,
                     const std::filesystem::path& model_folder,
                     uint64_t random_seed);

}  // namespace semfoam
