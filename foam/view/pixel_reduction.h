// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/view/view_renderer.h"

namespace semfoam {

// Averages `samples` x `samples` rays into each pixel: a photo's pixel is the mean of the light on
// its area, a ray is one point of it. `fine` is [samples * height][samples * width]. `centers`
// [height][width] was rendered through the pixels' centres; it keeps its distances, since a mean
// distance would lie between two surfaces, and gets from `fine`:
// color, opacity: the mean.
// class_index: if at least half of the rays have a class, the one with the largest sum of
// confidences, the first of equals; else kUnlabelled. confidence: that sum over the number of rays
// that have a class.
// CHECKs the sizes, and that `samples` is at least 1.
void AverageRays(const RenderedView& fine, int samples, RenderedView* centers);

}  // namespace semfoam
