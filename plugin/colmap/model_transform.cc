// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/model_transform.h"

namespace semfoam {

Pose TransformedPose(const Sim3& target_from_source, const Pose& pose) {
  Pose transformed = pose;
  const Eigen::Matrix3d rotation =
      pose.UnitRotation().toRotationMatrix() * target_from_source.rotation.transpose();
  // Without a turn the digits of the file stay.
  if (target_from_source.rotation != Eigen::Matrix3d::Identity()) {
    transformed.rotation = Eigen::Quaterniond(rotation).normalized();
  }
  transformed.translation =
      target_from_source.scale * pose.translation - rotation * target_from_source.translation;
  return transformed;
}

void TransformReconstruction(const Sim3& target_from_source, Reconstruction* reconstruction) {
  for (Image& image : reconstruction->images) {
    image.cam_from_world = TransformedPose(target_from_source, image.cam_from_world);
  }
  for (Point3D& point : reconstruction->points) {
    point.position = target_from_source.Apply(point.position);
  }
  if (reconstruction->frames) {
    for (Frame& frame : *reconstruction->frames) {
      frame.rig_from_world = TransformedPose(target_from_source, frame.rig_from_world);
    }
  }
  if (!reconstruction->rigs) return;
  for (Rig& rig : *reconstruction->rigs) {
    for (RigSensor& other : rig.others) {
      if (other.sensor_from_rig) other.sensor_from_rig->translation *= target_from_source.scale;
    }
  }
}

}  // namespace semfoam
