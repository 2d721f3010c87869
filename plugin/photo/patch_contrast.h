// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <optional>

#include <Eigen/Core>

namespace semfoam {

// Patches are sampled in a grid with so many samples along a side.
inline constexpr int kPatchSamples = 7;
// Largest distance of samples, in pixels.
inline constexpr double kLargestSampleSpacing = 4;

// Returns the contrast of a photo around a place, in pixels (the photo's corner is (0, 0)): the
// mean square of the difference between samples beside and below each other, over the square of
// their mean, in display values (the mean of the channels). Each sample is the mean of a square
// that reaches half-way to the next, so that photos from near and from far of one place, sampled at
// the same distance in space, have the same contrast, and blurred ones have less. `spacing`:
// distance of the samples, 1 to kLargestSampleSpacing pixels. Returns nothing for other spacings,
// where a sample is not inside the photo, and where the photo is cut off at white.
std::optional<float> PatchContrast(const Image8& photo,
                                   const Eigen::Vector2d& place,
                                   double spacing);

}  // namespace semfoam
