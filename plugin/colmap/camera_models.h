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
  int model_id = 0;     // COLMAP's number of the model
  uint64_t width = 0;   // pixels
  uint64_t height = 0;  // pixels
  std::vector<double> params;

  bool operator==(const Camera&) const = default;
};

// A camera model as COLMAP's documentation lists it. Parameters are the focal lengths (one for
// both axes, or two), the principal point (two), then the distortion; of EQUIRECTANGULAR, the
// width and height of the whole sphere in pixels.
struct CameraModel {
  int id = 0;
  std::string_view name;
  int num_params = 0;
  int num_focal_lengths = 0;  // 0: EQUIRECTANGULAR
};

// Null where COLMAP (up to 4.1) has no such model.
const CameraModel* FindCameraModel(int model_id);
const CameraModel* FindCameraModel(std::string_view name);

// Whether this parameter of a camera must be positive: the focal lengths, and EQUIRECTANGULAR's.
bool MustBePositive(const CameraModel& model, int parameter);

// The pixel that a point of the camera frame is seen at. Empty where it is not seen: behind a
// perspective camera, exactly behind a fisheye, or where a DIVISION model has no image.
std::optional<Eigen::Vector2d> Project(const Camera& camera, const Eigen::Vector3d& x_cam);

// The unit direction, in the camera frame, of the ray through `pixel`: the inverse of Project, to
// rounding, in closed form or by Newton's method. Empty where the distortion has no inverse: no
// solution, or one beyond the radius at which the distortion folds back, where two directions share
// a pixel. Rays of fisheyes, of DIVISION with k < 0 and of EQUIRECTANGULAR may point more than 90
// degrees off the axis.
std::optional<Eigen::Vector3d> Unproject(const Camera& camera, const Eigen::Vector2d& pixel);

// Whether rays of this camera need Newton's method, rather than a division.
bool IsDistorted(const Camera& camera);

// How far the distortion moves the image's corners, in pixels: the largest distance between a
// corner and where WithoutDistortion(camera) would see what is there. Infinite where a corner has
// no ray, or one that no pinhole camera has.
double DistortionAtCorners(const Camera& camera);

// The PINHOLE camera of the same size, focal lengths and principal point; of
// EQUIRECTANGULAR, with the pixels' size in its middle.
Camera WithoutDistortion(const Camera& camera);

// The same camera for photos of another size, by COLMAP's rule: two focal lengths and the
// principal point scale with their own axis, a single focal length with the mean of both, the
// distortion stays. EQUIRECTANGULAR's parameters scale each with their axis.
Camera RescaledCamera(const Camera& camera, uint64_t width, uint64_t height);

}  // namespace semfoam
