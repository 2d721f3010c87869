// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

namespace semfoam {

// A render and its photo.
struct ImagePair {
  Image8 render;
  Image8 photo;
};

// Returns the right halves of both, with the render in the photo's exposure: one gain per channel
// in linear light, fitted by least squares on the left half (pixels whose photo is within 6..249 in
// all channels and whose render is below 250), so that the fit does not use the scored pixels.
// CHECKs equal sizes.
ImagePair FitExposure(const Image8& render, const Image8& photo);

}  // namespace semfoam
