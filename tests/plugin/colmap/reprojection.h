// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <limits>
#include <unordered_map>

namespace semfoam {

// The mean, over the points, of each point's mean distance between its observations and where we
// project it to, pixels: what COLMAP's model_analyzer tells. Infinite where a point is not seen by
// an image of its track. The track's indices must be right.
inline double MeanReprojectionError(const Reconstruction& model) {
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  std::unordered_map<uint32_t, const Image*> images;
  for (const Image& image : model.images) images.emplace(image.id, &image);
  double total = 0;
  for (const Point3D& point : model.points) {
    double sum = 0;
    for (const TrackElement& element : point.track) {
      const Image& image = *images.at(element.image_id);
      const Pose& pose = image.cam_from_world;
      const auto pixel = Project(*cameras.at(image.camera_id),
                                 pose.UnitRotation() * point.position + pose.translation);
      if (!pixel) return std::numeric_limits<double>::infinity();
      const Point2D& seen = image.points.at(element.point2d_index);
      sum += (*pixel - Eigen::Vector2d(seen.x, seen.y)).norm();
    }
    total += sum / static_cast<double>(point.track.size());
  }
  return total / static_cast<double>(model.points.size());
}

}  // namespace semfoam
