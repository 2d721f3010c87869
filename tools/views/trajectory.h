// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// A camera path through the scene: one camera, and its pose in each frame (COLMAP frame).
struct Trajectory {
  // PINHOLE.
  Camera camera;
  std::vector<Pose> cam_from_world;
  double frames_per_second = 24;
};

struct TrajectoryOptions {
  // "orbit", "spiral", or a file (ReadTrajectory).
  std::string path = "orbit";
  // Number of frames; 0: 60, or that of the file.
  int num_frames = 0;
  // Width in pixels, which determines the height; 0: that of the first photo, or of the file.
  int width = 0;
};

// Makes a camera path of the given kind:
//   orbit   one turn around the middle, at the median distance and height of the photos' cameras.
//           Where these leave a gap of more than 90 degrees around the middle, there and back along
//           the part that they cover, because the other side is unknown.
//   spiral  two turns, from the lowest tenth of the cameras' elevations to the highest, and
//   from 1.2
//           to 0.8 of their distance.
// The middle is that of `box` (COLMAP frame), which then fills most of the picture; without a box,
// it is the origin of the normalised frame, in the middle of the photographed scene. The upward
// direction is perpendicular to the photos' sideways axes, as far as these determine it. The camera
// has the first photo's field of view. Throws UserError, naming `foam_path`, where there are no
// photos, on whose cameras the path depends.
Trajectory MakeTrajectory(const Model& model,
                          const std::filesystem::path& foam_path,
                          const std::optional<Eigen::AlignedBox3d>& box,
                          const TrajectoryOptions& options);

// Reads a path of the user: {"version": 1, "keyframes": [{"position": [x, y, z], "look_at": [x, y,
// z], "up": [x, y, z]}, ...], "frames": 120, "fps": 24, "closed": true, "width": 640, "height":
// 480, "fov": 60}, in COLMAP units; all but `version` and `keyframes` may be left out. Cameras pass
// the keyframes on a uniform Catmull-Rom spline, at equal times from one to the next; `closed`
// leads back to the first. `fov` is the horizontal field of view in degrees. Without `up`, width,
// height or fov these are the photos'. Throws UserError, one sentence naming the file, where it is
// missing, no JSON, or has a key or value that is not understood.
Trajectory ReadTrajectory(const std::filesystem::path& path,
                          const Model& model,
                          const TrajectoryOptions& options);

}  // namespace semfoam
