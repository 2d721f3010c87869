// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Suggests which photos to mask where only a few will be: those that together show most of the
// scene. The next photo is the one that adds most to what is shown, which is within 1 - 1/e of the
// best choice of that many photos (Nemhauser, Wolsey and Fisher, "An analysis of approximations for
// maximizing submodular set functions", 1978).
//
// Before a training, the scene is the voxels that hold SfM points, a twentieth of its extent wide;
// one voxel counts as much as another, however many points it has. A photo shows the voxels whose
// points it observes, and in part those around them, the less the farther away, since an SfM track
// names only some of the photos that see its point.

// A point of the scene and the photos that observe it.
struct ObservedPoint {
  // World frame, finite.
  Eigen::Vector3d position;
  std::vector<int32_t> views;
};

struct MaskSuggestion {
  // Share of the scene that the photos with a mask show, 0..1.
  double shown = 0;
  // A photo to mask, and that share once it has a mask, too.
  struct Photo {
    int32_t view = 0;
    double shown = 0;
  };
  // In the order in which they are to be masked. Ends early where no photo adds anything.
  std::vector<Photo> photos;
};

// Suggests up to `count` photos of those that `may_get_mask` [views] and have none yet. Ties: the
// lowest view. `has_mask` [views].
MaskSuggestion SuggestPhotosToMask(const std::vector<ObservedPoint>& points,
                                   const std::vector<bool>& has_mask,
                                   const std::vector<bool>& may_get_mask,
                                   int count);

// A part of a scene, and how much of it a photo shows, 0..1.
struct ShownPart {
  int32_t part = 0;
  float share = 0;
};

// Does the same for a scene of any parts: `weight` [parts], >= 0, is how much each counts, and
// `shown_by` [views] what each photo shows, each part once at most.
MaskSuggestion SuggestPhotosToMask(const std::vector<float>& weight,
                                   const std::vector<std::vector<ShownPart>>& shown_by,
                                   const std::vector<bool>& has_mask,
                                   const std::vector<bool>& may_get_mask,
                                   int count);

}  // namespace semfoam
