// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Checks a workspace for likely mistakes before a training of hours. Each function returns one
// sentence, or an empty string where there is nothing to report.

// Returns the sentences that are not empty, in their order.
std::vector<std::string> NonEmpty(std::vector<std::string> sentences);

// Names other models of a mapper, which writes one for each group of photos that it could not
// connect: 0, 1, 2, ... beside each other. Lists each with its number of photos where
// `model_folder` was found below `input_path` rather than named. Where it was named and is 0, which
// may be habit, lists only those with as many photos as it has (`num_images`) or more. Models that
// cannot be read are left out.
std::string OtherModelsWarning(const std::filesystem::path& input_path,
                               const std::filesystem::path& model_folder,
                               int64_t num_images);

// Warns where more than a fifth of the photos in `image_path` are not in the model.
std::string UnregisteredWarning(const std::filesystem::path& image_path,
                                int64_t num_unregistered,
                                int64_t num_registered);

// Warns where the poses and points of the model do not fit its observations: the median of the
// reprojection errors is above 4 pixels, or above 1 % of the photo's longer side where that is
// less, but at least 2. COLMAP's mapper drops each observation beyond 4 pixels, and the median of
// its models is below 1; one degree is 2 % of the side of a photo taken with a normal lens. Models
// of less than 50 observations are not judged. Samples some 100,000 observations.
std::string ReprojectionWarning(const std::filesystem::path& model_folder,
                                const Reconstruction& model);

}  // namespace semfoam
