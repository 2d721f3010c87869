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

// A way through the scene: one camera, and where it is in each frame (COLMAP frame).
struct Trajectory {
  Camera camera;  // PINHOLE
  std::vector<Pose> cam_from_world;
  double frames_per_second = 24;
};

struct TrajectoryOptions {
  std::string path = "orbit";  // "orbit", "spiral", or a file, see ReadTrajectory
  int num_frames = 0;          // 0: 60, or what the file says
  int width = 0;               // pixels; the height follows. 0: the first photo's, or the file's
};

// orbit   once around, looking at the middle, as far from it and as high above it as the photos'
//         cameras are in the median. Where these leave a gap of more than 90 degrees around it,
//         there and back along what they cover: nobody knows the other side.
// spiral  twice so, from the lowest tenth of the cameras' elevations to the highest, from 1.2 to
// 0.8
//         of their distance.
// The middle is that of `box` (COLMAP frame), which then fills most of the picture, or the origin
// of the normalised frame, which lies in the middle of what was photographed. Up is
// at right angles to the photos' sideways axes, as far as these tell. The camera has the first
// photo's field of view. Throws UserError, calling the model `foam_path`, where there are no
// photos, whose cameras say all this.
Trajectory MakeTrajectory(const Model& model,
                          const std::filesystem::path& foam_path,
                          const std::optional<Eigen::AlignedBox3d>& box,
                          const TrajectoryOptions& options);

// A path of one's own: {"version": 1, "keyframes": [{"position": [x, y, z], "look_at": [x, y, z],
// "up": [x, y, z]}, ...], "frames": 120, "fps": 24, "closed": true, "width": 640, "height": 480,
// "fov": 60}, in COLMAP units; all but `version` and `keyframes` may be left out. Cameras pass the
// keyframes on a uniform Catmull-Rom spline, at equal times from one to the next; `closed` leads
// back to the first. `fov` is the horizontal field of view in degrees. Without `up`, width, height
// or fov these are the photos'. Throws UserError, one sentence naming the file, where it is
// missing, no JSON, or has a key or value that is not understood.
Trajectory ReadTrajectory(const std::filesystem::path& path,
                          const Model& model,
                          const TrajectoryOptions& options);

}  // namespace semfoam
