// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/plane_sweep.h"
#include "plugin/stereo/stereo_view.h"

#include <cstdint>

namespace semfoam {

// Depths of walls, floors and table tops beyond what is known of them: a few known parts, such as
// the pictures on a wall, tell the plane of all of it.

// Returns the depths of `known`, and of unknown pixels that belong to a large plane; 0 elsewhere,
// as in `known`.
//
// Planes are fitted (FitPlane) to the known inverse depths, which are linear in the image on a
// plane, one after the other, each to what is not on one before. Each known pixel votes for the
// planes that it is on; an unknown one gets the depth of the plane that has the majority of those
// to which paths through pixels of like colour lead, past the noise of the photo (ImagePaths). It
// stays unknown where they are few, and off their line where they are on one.
//
// `known` has the view's pixels. The result says nothing of what other views see there.
DepthMap FillPlanes(const StereoView& view, const DepthMap& known);

// Returns the peak memory of FillPlanes beside its result, in bytes.
int64_t FillPlanesBytes();

}  // namespace semfoam
