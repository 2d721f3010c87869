// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/tracks.h"
#include "plugin/photometric/camera_placement.h"

#include <vector>

namespace semfoam {

// Adjusts camera poses to the tracks of SfM points (bundle adjustment), and tells by tracks that
// were held back whether they are better than before.

// A photo of the tracks.
struct TrackView {
  Camera camera;
  CameraPlacement placement;
  // Whether its observations are left out, and it stays where it is.
  bool held_out = false;
};

// Tracks in the normalised frame, as far as views that are not held out observe them: three times
// or more.
struct AdjustableTracks {
  struct Observation {
    int view = 0;
    Eigen::Vector2d pixel;
    PixelFrame frame;
  };
  struct Point {
    Eigen::Vector3d position;
    std::vector<Observation> observations;
  };
  std::vector<Point> points;
};

AdjustableTracks MakeAdjustable(const std::vector<Track>& tracks,
                                const Similarity& world_from_normalized,
                                const std::vector<TrackView>& views);

// Moves views and points to the least reprojection errors of the points [first, first + step, ...)
// under Cauchy's noise, whose scale is that of the median error. Short tracks leave room for poses
// and points to bend together. So priors hold both: of motions of views, normal, as wide as the
// motions found, and of movements of points, Cauchy's, as wide as their median; both are found in
// rounds. The points also hold the frame, in which held-out photos stay. Returns the placements
// [views]. The result does not depend on the number of threads.
std::vector<CameraPlacement> AdjustToTracks(const AdjustableTracks& tracks,
                                            const std::vector<TrackView>& views,
                                            int first,
                                            int step);

// Triangulates the points [first, first + step, ...) anew from each of two sets of placements, and
// returns by which share of the squared reprojection errors the second ones are better, errors
// being capped at four times the median that the first ones leave. 0 without points.
double TrackGain(const AdjustableTracks& tracks,
                 const std::vector<CameraPlacement>& before,
                 const std::vector<CameraPlacement>& after,
                 int first,
                 int step);

}  // namespace semfoam
