// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <array>

namespace semfoam {

// One gain per channel, in linear light.
using Gains = std::array<double, 3>;

// Returns the gains that bring a render into the photo's exposure, fitted by least squares on the
// left half (pixels whose photo is within 6..249 in all channels and whose render is below 250), so
// that the fit does not use pixels of the right half. CHECKs equal sizes.
Gains FitGains(const Image8& render, const Image8& photo);

// Returns the picture under these gains, clipped.
Image8 WithGains(const Image8& image, const Gains& gains);

// Returns the right half of a picture.
Image8 RightHalf(const Image8& image);

}  // namespace semfoam
