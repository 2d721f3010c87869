// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

namespace semfoam {

// The foam that a training of `reconstruction` would begin with, colour alone: a cell at every
// point (InitialFoam), the cameras of its images, no labels. `model_folder` is what errors call
// the reconstruction. Throws UserError where it has no image.
Model UntrainedModel(const Reconstruction& reconstruction,
                     const std::filesystem::path& model_folder,
                     uint64_t random_seed);

}  // namespace semfoam
