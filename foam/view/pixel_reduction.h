// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/view/view_renderer.h"

namespace semfoam {

// Averages `samples` x `samples` rays into each pixel. `fine` is [samples * height][samples *
// width]; returns [height][width]. A photo's pixel is the mean of the light on its area, a ray is
// one point of it.
//
// color, opacity: the mean. distance: where at least half of the rays end, the median of those that
// do (the lower one of an even number), so that no depth lies between two surfaces; else 0.
// class_index: where at least half of the rays see a class, the one with the largest sum of
// confidences, the first of equals; confidence: that sum over the number of rays that see a class.
// CHECKs that both sizes are multiples of `samples`, which is at least 1.
RenderedView AverageRays(const RenderedView& fine, int samples);

}  // namespace semfoam
