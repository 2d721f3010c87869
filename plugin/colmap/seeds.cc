// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/seeds.h"

#include "foam/geometry/guard_sites.h"
#include "plugin/colmap/normalized_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <glog/logging.h>

namespace semfoam {

SeenImages FindSeenImages(const std::vector<Image>& images,
                          const std::vector<Camera>& cameras,
                          const std::vector<PhotoRecord>& photos) {
  CHECK_EQ(images.size(), photos.size());
  std::unordered_map<uint32_t, const Camera*> camera_of;
  for (const Camera& camera : cameras) camera_of.emplace(camera.id, &camera);
  SeenImages seen;
  for (size_t i = 0; i < images.size(); ++i) {
    if (photos[i].held_out) continue;
    const Camera& camera = *camera_of.at(images[i].camera_id);
    const Eigen::Vector2d scale(photos[i].width / static_cast<double>(camera.width),
                                photos[i].height / static_cast<double>(camera.height));
    seen.emplace(images[i].id, SeenImage{static_cast<int32_t>(i), &images[i], scale});
  }
  return seen;
}

void AppendObservations(const Point3D& point,
                        const SeenImages& images,
                        PixelObservations* observations) {
  for (const TrackElement& element : point.track) {
    const auto seen = images.find(element.image_id);
    if (seen == images.end() || element.point2d_index >= seen->second.image->points.size()) {
      continue;
    }
    const Point2D& feature = seen->second.image->points[element.point2d_index];
    if (!std::isfinite(feature.x) || !std::isfinite(feature.y)) continue;
    observations->push_back(
        {seen->second.view,
         Eigen::Vector2d(feature.x, feature.y).cwiseProduct(seen->second.scale)});
  }
}

void MakeSeeds(std::vector<Point3D> points,
               const Similarity& world_from_normalized,
               const SeenImages& images,
               std::vector<SeedPoint>* seeds,
               std::vector<PixelObservations>* observations) {
  std::sort(
      points.begin(), points.end(), [](const Point3D& a, const Point3D& b) { return a.id < b.id; });
  const bool has_tracks = std::any_of(
      points.begin(), points.end(), [](const Point3D& point) { return !point.track.empty(); });
  std::map<std::array<float, 3>, size_t> seed_at;
  for (const Point3D& point : points) {
    if (has_tracks && point.track.empty()) continue;
    const Eigen::Vector3d position = world_from_normalized.Invert(point.position);
    if (!position.allFinite() || position.norm() > kFarRadius) continue;
    const Eigen::Vector3f rounded = position.cast<float>();
    const auto [entry, is_new] =
        seed_at.try_emplace({rounded.x(), rounded.y(), rounded.z()}, seeds->size());
    if (is_new) {
      seeds->push_back({rounded, point.color.cast<float>() / 255.0f});
      if (!images.empty()) observations->emplace_back();
    }
    if (!images.empty()) AppendObservations(point, images, &(*observations)[entry->second]);
  }
}

Similarity NormalizedFrameOf(const Reconstruction& model) {
  std::vector<Viewpoint> viewpoints;
  viewpoints.reserve(model.images.size());
  for (const Image& image : model.images) {
    viewpoints.push_back(
        {image.cam_from_world.Center(),
         image.cam_from_world.UnitRotation().conjugate() * Eigen::Vector3d::UnitZ()});
  }
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(model.points.size());
  for (const Point3D& point : model.points) positions.push_back(point.position);
  return NormalizedFrame(viewpoints, positions);
}

}  // namespace semfoam
