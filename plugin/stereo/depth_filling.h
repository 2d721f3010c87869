// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/plane_sweep.h"
#include "plugin/stereo/stereo_view.h"

#include <cstdint>

namespace semfoam {

// Depths of the plain parts of photos, where matching finds none: pixels of one colour that lie
// side by side lie on one surface. On a plane, inverse depth is linear in the image.

// Returns the depths of `known`, and of the pixels that are unknown there and that known ones
// surround on one plane; 0 elsewhere, as in `known`.
//
// At each pixel a plane is fitted to the known inverse depths around it (ImagePaths), of which
// those within some 4 pixels count; where that fails 8, 16 and 32. The pixel stays unknown where
// - the weights sum up to less than that of two pixels,
// - it lies outside the known ones: its Mahalanobis distance from their mean is above sqrt(2),
// - they are not on one plane: their deviation from the fit is above 2 % of its value.
//
// `known` has the view's pixels. The result says nothing of what other views see there.
DepthMap FillDepths(const StereoView& view, const DepthMap& known);

// Returns the peak memory of FillDepths beside its result, in bytes.
int64_t FillDepthsBytes();

}  // namespace semfoam
