// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/similarity.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// Where cameras stand, how they move, and what that does to the pixels at which they see a point.

// A camera in the normalised frame.
struct CameraPlacement {
  Eigen::Matrix3d world_from_cam = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

CameraPlacement PlacementOf(const Pose& cam_from_world, const Similarity& world_from_normalized);
Pose PoseOf(const CameraPlacement& placement, const Similarity& world_from_normalized);

// A movement of a camera: a rotation vector about its centre, along the axes of the normalised
// frame, in radians (0 to 2), and a shift of the centre (3 to 5).
using CameraMotion = Eigen::Matrix<double, 6, 1>;

CameraPlacement Moved(const CameraPlacement& placement, const CameraMotion& motion);

// Returns the angle between two placements, in radians.
double AngleBetween(const CameraPlacement& a, const CameraPlacement& b);

// The rays of a camera around one pixel.
struct PixelFrame {
  // Unit direction through the pixel, camera frame.
  Eigen::Vector3d direction;
  // Pixels per change of the direction, across it.
  Eigen::Matrix<double, 2, 3> pixels;

  // Returns how far from the pixel a point of the camera frame is seen, to first order in that
  // distance for lenses with distortion, exact without. The point must be before the camera:
  // direction . point > 0.
  template <typename T>
  Eigen::Matrix<T, 2, 1> OffsetOf(const Eigen::Matrix<T, 3, 1>& point) const {
    const T along = direction.cast<T>().dot(point);
    return pixels.cast<T>() * (point / along);
  }
};

// Returns nothing where the camera has no ray at the pixel or half a pixel beside it.
std::optional<PixelFrame> PixelFrameAt(const Camera& camera, const Eigen::Vector2d& pixel);

// Returns the derivative of frame.OffsetOf(point seen from the moved camera) by the motion, at no
// motion. `point` is in the normalised frame.
Eigen::Matrix<double, 2, 6> OffsetByMotion(const PixelFrame& frame,
                                           const CameraPlacement& placement,
                                           const Eigen::Vector3d& point);

// Moves `placements` by the similarity that leads them back to `reference` best, in centres and
// orientations (an angle in radians counts as a distance in the normalised frame). Only placements
// relative to each other are observable; so what is refined does not drift away from the frame of
// the file, in which held-out photos stay. Both have the same size.
void RemoveDrift(const std::vector<CameraPlacement>& reference,
                 std::vector<CameraPlacement>* placements);

}  // namespace semfoam
