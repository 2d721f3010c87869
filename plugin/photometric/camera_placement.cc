// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/camera_placement.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <glog/logging.h>

namespace semfoam {
namespace {

Eigen::Matrix3d Rotation(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Vector3d RotationVector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

CameraPlacement PlacementOf(const Pose& cam_from_world, const Similarity& world_from_normalized) {
  return {cam_from_world.UnitRotation().toRotationMatrix().transpose(),
          world_from_normalized.Invert(cam_from_world.Center())};
}

Pose PoseOf(const CameraPlacement& placement, const Similarity& world_from_normalized) {
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(placement.world_from_cam.transpose()));
  pose.rotation.normalize();
  if (pose.rotation.w() < 0) pose.rotation.coeffs() *= -1;
  pose.translation = pose.rotation * -world_from_normalized.Apply(placement.center);
  return pose;
}

CameraPlacement Moved(const CameraPlacement& placement, const CameraMotion& motion) {
  return {Rotation(motion.head<3>()) * placement.world_from_cam,
          placement.center + motion.tail<3>()};
}

double AngleBetween(const CameraPlacement& a, const CameraPlacement& b) {
  return RotationVector(a.world_from_cam * b.world_from_cam.transpose()).norm();
}

std::optional<PixelFrame> PixelFrameAt(const Camera& camera, const Eigen::Vector2d& pixel) {
  const auto direction = Unproject(camera, pixel);
  if (!direction) return {};
  PixelFrame frame;
  frame.direction = *direction;
  // By pixels, of the plane across the direction at distance 1.
  Eigen::Matrix<double, 3, 2> by_pixels;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
    const auto after = Unproject(camera, pixel + half), before = Unproject(camera, pixel - half);
    if (!after || !before) return {};
    by_pixels.col(axis) = *after / after->dot(*direction) - *before / before->dot(*direction);
  }
  const Eigen::Matrix2d square = by_pixels.transpose() * by_pixels;
  if (!(square.determinant() > 0)) return {};
  frame.pixels = square.inverse() * by_pixels.transpose();
  return frame;
}

Eigen::Matrix<double, 2, 6> OffsetByMotion(const PixelFrame& frame,
                                           const CameraPlacement& placement,
                                           const Eigen::Vector3d& point) {
  const Eigen::Vector3d from_center = point - placement.center;
  const Eigen::Matrix3d cam_from_world = placement.world_from_cam.transpose();
  const Eigen::Vector3d seen = cam_from_world * from_center;
  const double along = frame.direction.dot(seen);
  // Of seen / along.
  const Eigen::Matrix3d by_seen =
      (Eigen::Matrix3d::Identity() - seen * frame.direction.transpose() / along) / along;
  Eigen::Matrix<double, 3, 6> seen_by_motion;
  // A camera that turns sees points turn the other way.
  seen_by_motion << cam_from_world * CrossMatrix(from_center), -cam_from_world;
  return frame.pixels * by_seen * seen_by_motion;
}

void RemoveDrift(const std::vector<CameraPlacement>& reference,
                 std::vector<CameraPlacement>* placements) {
  CHECK_EQ(reference.size(), placements->size());
  // Without a spread of the centres there is no scale to find.
  constexpr double kPrior = 1e-6;
  constexpr int kSteps = 3;
  for (int step = 0; step < kSteps; ++step) {
    // Rotation vector, shift, and logarithm of the scale, about the origin.
    Eigen::Matrix<double, 7, 7> normal = kPrior * Eigen::Matrix<double, 7, 7>::Identity();
    Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
    for (size_t i = 0; i < reference.size(); ++i) {
      const CameraPlacement& from = (*placements)[i];
      Eigen::Matrix<double, 6, 7> change = Eigen::Matrix<double, 6, 7>::Zero();
      change.topLeftCorner<3, 3>().setIdentity();
      change.bottomLeftCorner<3, 3>() = -CrossMatrix(from.center);
      change.block<3, 3>(3, 3).setIdentity();
      change.bottomRightCorner<3, 1>() = from.center;
      CameraMotion lacking;
      lacking << RotationVector(reference[i].world_from_cam * from.world_from_cam.transpose()),
          reference[i].center - from.center;
      normal += change.transpose() * change;
      right += change.transpose() * lacking;
    }
    const Eigen::Matrix<double, 7, 1> drift = normal.ldlt().solve(right);
    const Eigen::Matrix3d rotation = Rotation(drift.head<3>());
    for (CameraPlacement& placement : *placements) {
      placement.world_from_cam = rotation * placement.world_from_cam;
      placement.center = std::exp(drift[6]) * (rotation * placement.center) + drift.segment<3>(3);
    }
  }
}

}  // namespace semfoam
