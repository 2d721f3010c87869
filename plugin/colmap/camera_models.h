// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A camera of a COLMAP model: intrinsics shared by the images that name its id. Pixels: the corner
// of the image is (0, 0), the centre of its first pixel (0.5, 0.5). Camera frame: x right, y down,
// z forward.
struct Camera {
  uint32_t id = 0;
  // COLMAP's number of the camera model.
  int model_id = 0;
  // Size in pixels.
  uint64_t width = 0;
  uint64_t height = 0;
  std::vector<double> params;

  bool operator==(const Camera&) const = default;
};

// A camera model of COLMAP's documentation. Its parameters are the focal lengths (one for both
// axes, or two), the principal point (two), then the distortion; those of EQUIRECTANGULAR are the
// width and height of the whole sphere in pixels.
struct CameraModel {
  int id = 0;
  std::string_view name;
  int num_params = 0;
  // Number of focal lengths, 1 or 2; 0: EQUIRECTANGULAR.
  int num_focal_lengths = 0;
};

// Returns the model with this number; null where COLMAP (up to 4.1) has none.
const CameraModel* FindCameraModel(int model_id);
const CameraModel* FindCameraModel(std::string_view name);

// Returns whether this parameter of a camera must be positive: the focal lengths and all parameters
// of EQUIRECTANGULAR.
bool MustBePositive(const CameraModel& model, int parameter);

// Projects a point of the camera frame to a pixel. Returns nothing where the camera does not see
// it: behind a perspective camera, exactly behind a fisheye, or where a DIVISION model has no
// image.
std::optional<Eigen::Vector2d> Project(const Camera& camera, const Eigen::Vector3d& x_cam);

// Returns the unit direction, in the camera frame, of the ray through `pixel`: the inverse of
// Project, to rounding, in closed form or by Newton's method. Returns nothing where the distortion
// has no inverse: no solution, or one beyond the radius at which the distortion folds back, where
// two directions share a pixel. Rays of fisheyes, of DIVISION with k < 0 and of EQUIRECTANGULAR may
// point more than 90 degrees off the axis.
std::optional<Eigen::Vector3d> Unproject(const Camera& camera, const Eigen::Vector2d& pixel);

// Returns whether rays of this camera need Newton's method instead of a division.
bool IsDistorted(const Camera& camera);

// Returns how far the distortion moves the image's corners, in pixels: the largest distance between
// a corner and the projection of its ray by WithoutDistortion(camera). Infinite where a corner has
// no ray, or one that no pinhole camera has.
double DistortionAtCorners(const Camera& camera);

// Returns the PINHOLE camera of the same size, focal lengths and principal point; for
// EQUIRECTANGULAR, the one with the same resolution in the middle.
Camera WithoutDistortion(const Camera& camera);

// Returns the camera rescaled to photos of another size, by COLMAP's rule: two focal lengths and
// the principal point scale with their own axes, a single focal length with the mean of both, the
// distortion stays. EQUIRECTANGULAR's parameters each scale with their axis.
Camera RescaledCamera(const Camera& camera, uint64_t width, uint64_t height);

}  // namespace semfoam
