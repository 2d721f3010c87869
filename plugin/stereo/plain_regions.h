// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/reduced_view.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Regions of a photo that tell no depth pixel by pixel, and what other photos show in their place.

struct PlainRegions {
  // [pixels] Index of the region; -1: none.
  std::vector<int> of_pixel;
  // [regions] Number of pixels.
  std::vector<int> sizes;
};

// Returns the largest regions of pixels of unknown depth that lie side by side and differ by at
// most 0.04, display values, in each channel.
PlainRegions FindPlainRegions(const ReducedView& reduced);

// Computes the colour that a view shows at a point, given as an offset from the view's centre,
// between its pixels. Returns false where it does not show the point, or something of known depth.
bool SampleUnknown(const ReducedView& reduced,
                   const Eigen::Vector3d& offset,
                   Eigen::Vector3f* color);

}  // namespace semfoam
