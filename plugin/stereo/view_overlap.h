// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "plugin/colmap/tracks.h"
#include "plugin/stereo/stereo_view.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Which views show the same surfaces, and at which depths, by the SfM points.

// A range of inverse depths along z, in units of the normalised frame; 0 < far < near.
struct InverseDepths {
  double far = 0;
  double near = 0;
  bool IsEmpty() const { return !(far > 0 && far < near); }
};

// What a view is matched with.
struct ViewOverlap {
  // Indices into the views, of those that match best, in this order; at most kMostPartners.
  std::vector<int> partners;
  InverseDepths depths;
};

// Maximum number of partners: the first four are matched with, all are compared with.
inline constexpr size_t kMostPartners = 16;

// Finds the partners and the depths of all views by the points that a view sees: those of `tracks`
// (in the normalised frame; PixelObservation::view is the index of the photo), or, where these are
// few, all `seeds` within its image. Of two views the score is the sum over the points of the first
// one that lie in the image of the second, of
//
//   g(angle between the rays) * min(r, 1 / r) * (1 if the track has both views, else 0.25),
//
// with r the ratio of the sizes in the images and g = 1 at 10 degrees and small where rays are
// nearly parallel, whose depths are uncertain, or far apart, which see different sides. The depths
// reach from the 2 % quantile of the points' depths over 1.5 to 1.5 times the 98 % quantile, since
// surfaces without SfM points may be before and behind the others. A view with fewer than 10 points
// has neither.
std::vector<ViewOverlap> FindOverlaps(const std::vector<StereoView>& views,
                                      const std::vector<Track>& tracks,
                                      const std::vector<SeedPoint>& seeds);

}  // namespace semfoam
