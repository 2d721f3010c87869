// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What the probe of the effects asks of a photo, kept when its pixels are not.
struct PhotoSurvey {
  // The 3 x 3 pixels around a place, row by row, RGB.
  using Patch = std::array<uint8_t, 27>;
  std::vector<std::optional<Patch>> patches;  // of each place; none where it is not all inside
  int64_t border_pixels = 0;
  int64_t white_border_pixels = 0;  // every channel 250 or more
};

// `places` in pixels; the photo's corner is (0, 0).
PhotoSurvey SurveyPhoto(const Image8& photo, const std::vector<Eigen::Vector2d>& places);

}  // namespace semfoam
