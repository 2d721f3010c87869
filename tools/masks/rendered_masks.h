// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/view/view_renderer.h"
#include "tools/masks/mask_writers.h"

#include <filesystem>

namespace semfoam {

// Throws UserError naming `foam_path`, the file of the model, where the model has no labels or no
// photos.
void RequireMaskedPhotos(const Model& model, const std::filesystem::path& foam_path);

// Renders the masks of all photos of a model, and writes them into `output_path` (MakeMaskWriter).
// `renderer` must be of the model's foam. Throws UserError as MakeMaskWriter does, and where a
// photo's camera is invalid. Returns the number of photos.
size_t WriteRenderedMasks(const Model& model,
                          const std::filesystem::path& foam_path,
                          const ViewRenderer& renderer,
                          MaskOutput output,
                          const std::filesystem::path& output_path);

}  // namespace semfoam
