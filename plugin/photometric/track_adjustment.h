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
// under Cauchy's noise, whose scale is that of the median error. A weak prior of kMotionPrior holds
// views that few points see. Returns the placements [views], without drift (RemoveDrift). The
// result does not depend on the number of threads.
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

// Standard deviation of the motions that the prior expects, in radians and units of the normalised
// frame.
inline constexpr double kMotionPrior = 0.02;

}  // namespace semfoam
