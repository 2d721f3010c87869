// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/surface_seeds.h"

#include <filesystem>

namespace semfoam {

// Writes what a plane sweep found as a checksummed file (foam/train/checkpoint.h), so that the
// blocks and the merge of a run do not sweep again. Throws UserError where it cannot be written.
void WriteSurfaceSeeds(const std::filesystem::path& path, const SurfaceSeeds& found);

// Reads it. Throws as Checkpoint where the file is missing, damaged, or not of `num_views` views.
SurfaceSeeds ReadSurfaceSeeds(const std::filesystem::path& path, int num_views);

}  // namespace semfoam
