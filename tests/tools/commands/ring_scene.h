// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <string>

#include "tests/foam/edit/object_scenes.h"

// A small foam made by hand, and photos that look at it.
namespace semfoam {

inline PhotoRecord PhotoFrom(const std::string& name, const Eigen::Vector3d& center) {
  const CameraRays rays = LookAt(center, {0, 0, 0}, Eigen::Vector3d(-center.y(), center.x(), 0));
  // The camera's axes, from its rays at the corners.
  const Eigen::Vector3d forward = -center.normalized();
  const Eigen::Vector3d right = Eigen::Vector3d(-center.y(), center.x(), 0).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  PhotoRecord photo;
  photo.name = name;
  photo.camera_model = "PINHOLE";
  photo.width = photo.height = rays.width;
  photo.camera_params = {80, 80, 40, 40};
  photo.cam_from_world_rotation = Eigen::Quaterniond(cam_from_world);
  photo.cam_from_world_translation = -(cam_from_world * center);
  return photo;
}

// The ring on its table, the ball in the ring, and four photos, upright: z is up. In a COLMAP frame
// ten times as large.
inline Model RingScene() {
  Model model = RingTableBallModel(1);
  model.labels = {{LabelId{10}, MaskId{10}, "ring"},
                  {LabelId{11}, MaskId{11}, "table"},
                  {LabelId{12}, MaskId{12}, "ball"}};
  model.world_from_normalized = {10, {5, 0, 0}};
  int index = 0;
  for (const Eigen::Vector3d& center : {Eigen::Vector3d(1.5, 0, 1.2),
                                        Eigen::Vector3d(-1.5, 0, 1.2),
                                        Eigen::Vector3d(0, 1.5, 1.2),
                                        Eigen::Vector3d(0, -1.5, 1.2)}) {
    PhotoRecord photo = PhotoFrom("p, " + std::to_string(index++) + ".png", center);
    // x_world = 10 x + (5, 0, 0)
    photo.cam_from_world_translation = 10 * photo.cam_from_world_translation -
                                       photo.cam_from_world_rotation * Eigen::Vector3d(5, 0, 0);
    model.photos.push_back(photo);
  }
  return model;
}

}  // namespace semfoam
