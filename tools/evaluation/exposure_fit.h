// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

namespace semfoam {

// A render and its photo, to be compared.
struct ImagePair {
  Image8 render;
  Image8 photo;
};

// The right halves of both, the render brought to the photo's exposure: per channel one gain in
// linear light, fitted by least squares on the left half (pixels whose photo is within 6..249 in
// all channels and whose render is below 250), so that the fit knows nothing of what is scored.
// CHECKs equal sizes.
ImagePair FitExposure(const Image8& render, const Image8& photo);

}  // namespace semfoam
