// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A place at which a photo is surveyed.
struct SurveyPlace {
  // The photo's corner is (0, 0).
  Eigen::Vector2d pixel;
  // Of the samples of PatchContrast, in pixels.
  double spacing = 1;
};

// The data of a photo for the probe of the effects, kept after its pixels are released.
struct PhotoSurvey {
  // The 3 x 3 pixels around a position, row by row, RGB.
  using Patch = std::array<uint8_t, 27>;
  // [places] Nothing where the patch is not completely inside the photo.
  std::vector<std::optional<Patch>> patches;
  // [places] PatchContrast.
  std::vector<std::optional<float>> contrasts;
  int64_t border_pixels = 0;
  // Number of pixels of the border whose channels are all 250 or more.
  int64_t white_border_pixels = 0;
};

// Surveys a photo at `places`.
PhotoSurvey SurveyPhoto(const Image8& photo, const std::vector<SurveyPlace>& places);

}  // namespace semfoam
