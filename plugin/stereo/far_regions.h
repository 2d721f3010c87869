// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Finds what photos show so far away that nothing tells its distance: sky, hills on the horizon,
// the other end of a hall behind a small thing. Single pixels do not tell: sky is plain, and so are
// the walls of a room. All pixels of a region together do.

// What FindFarRegions has to know of a view beside its picture.
struct RegionInput {
  // [pixels] 1: the pixel's depth is known. Empty: the view takes no part.
  std::vector<uint8_t> is_known;
  // The largest inverse depth of what the view may show, in units of the normalised frame.
  double nearest = 0;
};

// Returns [views][pixels] 1 for what is infinitely far; empty for views that take no part.
//
// Regions are of pixels without a known depth that lie side by side and differ little in colour, in
// photos reduced to a quarter of their size. A region is compared with what other views show of it
// if it lies at infinity, and if it lies on one of the planes parallel to the image that some view
// shows 4 or more of the reduced pixels away from where it would show them at infinity. It is far
// if the mean squared difference of colour, of which no pixel counts more than (0.03)^2, is at most
// 0.8 of that on any of the planes. Regions of less than 1 % of the pixels, or that other views
// hardly show, tell nothing. Deterministic on any number of threads.
//
// `inputs` [views].
std::vector<std::vector<uint8_t>> FindFarRegions(const std::vector<StereoView>& views,
                                                 const std::vector<RegionInput>& inputs);

// Returns the peak memory of FindFarRegions beside its result, in bytes.
uint64_t FarRegionBytes(int64_t num_views);

}  // namespace semfoam
