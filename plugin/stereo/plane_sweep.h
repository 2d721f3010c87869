// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"
#include "plugin/stereo/view_overlap.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Dense depths by a plane sweep (Collins, A space-sweep approach to true multi-image matching, CVPR
// 1996; Gallup et al., Real-time plane-sweeping stereo with multiple sweeping directions, CVPR
// 2007).

inline constexpr int kNumPlanes = 64;

// Inverse depths of a view's pixels.
struct DepthMap {
  // [height][width] 1 / depth along z, in units of the normalised frame; 0 = unknown.
  std::vector<float> inverse;
};

// Finds the depth of each pixel of a view among kNumPlanes planes parallel to its image, evenly
// spaced in inverse depth. `partners` are one to four views.
//
// A pixel's score on a plane is the zero-mean normalised cross-correlation of the 5 x 5 pixels
// around it with what the plane shows of the partners: the mean of the two best partners, because a
// surface may be hidden from the others. The depth is that of the best plane, refined by the
// parabola through its score and those of the planes beside it. It stays unknown where
// - the window or the 3 x 3 pixels in its middle are nearly of one colour (standard deviation below
//   1 % of white): beside an outline, the window has texture, but of another surface perhaps,
// - fewer than two partners show it, or the best score is below 0.7,
// - another plane, more than two pixels away in the partner with the widest baseline, is nearly as
//   good (ambiguous texture), or
// - the best plane is the first or the last one.
DepthMap SweepPlanes(const StereoView& view,
                     const std::vector<const StereoView*>& partners,
                     const InverseDepths& depths);

// Returns the peak memory of SweepPlanes, in bytes.
int64_t SweepPlanesBytes();

}  // namespace semfoam
