// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/tracks.h"

#include "foam/util/random.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr uint64_t kTrackPurpose = 0x7472616b;
constexpr size_t kFewestObservations = 3;  // of a point
constexpr int64_t kObservations = 12'000;
constexpr int64_t kObservationsPerPhoto = 60;
constexpr size_t kPhotosPerCamera = 4;

}  // namespace

std::vector<Track> SampleTracks(const Reconstruction& model,
                                const std::vector<PhotoRecord>& photos,
                                uint64_t random_seed) {
  CHECK_EQ(model.images.size(), photos.size());
  std::unordered_map<uint64_t, size_t> photos_of_point;
  for (const Image& image : model.images) {
    for (const Point2D& seen : image.points) {
      if (seen.point3d_id != kNoPoint3D) ++photos_of_point[seen.point3d_id];
    }
  }
  std::vector<std::pair<uint64_t, const Point3D*>> order;  // by chance
  for (const Point3D& point : model.points) {
    const auto photos_here = photos_of_point.find(point.id);
    if (photos_here == photos_of_point.end() || photos_here->second < kFewestObservations) continue;
    if (!point.position.allFinite()) continue;
    order.emplace_back(CounterRandom(random_seed, kTrackPurpose, point.id).Next(), &point);
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second->id < b.second->id;
  });
  const int64_t wanted =
      std::max(kObservations, kObservationsPerPhoto * static_cast<int64_t>(photos.size()));
  std::map<uint64_t, Track> tracks;
  int64_t observations = 0;
  for (const auto& [key, point] : order) {
    if (observations >= wanted) break;
    observations += static_cast<int64_t>(photos_of_point[point->id]);
    tracks[point->id].position = point->position;
  }

  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  for (size_t view = 0; view < photos.size(); ++view) {
    const Camera& camera = *cameras.at(model.images[view].camera_id);
    const Eigen::Vector2d scale(photos[view].width / static_cast<double>(camera.width),
                                photos[view].height / static_cast<double>(camera.height));
    for (const Point2D& seen : model.images[view].points) {
      const auto track = tracks.find(seen.point3d_id);
      if (track == tracks.end()) continue;
      PixelObservations& seen_in = track->second.observations;
      if (!seen_in.empty() && seen_in.back().view == static_cast<int32_t>(view)) continue;
      seen_in.push_back(
          {static_cast<int32_t>(view), Eigen::Vector2d(seen.x, seen.y).cwiseProduct(scale)});
    }
  }
  std::vector<Track> sample;
  sample.reserve(tracks.size());
  for (auto& [id, track] : tracks) sample.push_back(std::move(track));
  return sample;
}

std::vector<int> LensOfPhotos(const Reconstruction& model, const std::vector<PhotoRecord>& photos) {
  CHECK_EQ(model.images.size(), photos.size());
  using Lens = std::tuple<uint32_t, std::string, int, int>;
  std::map<uint32_t, int> cameras;
  for (const Image& image : model.images) ++cameras[image.camera_id];
  const bool by_camera = photos.size() >= kPhotosPerCamera * cameras.size();
  std::map<Lens, int> lenses;
  std::vector<int> lens_of_photo;
  for (size_t i = 0; i < photos.size(); ++i) {
    const Lens lens = by_camera
                          ? Lens{model.images[i].camera_id, "", 0, 0}
                          : Lens{0, photos[i].camera_model, photos[i].width, photos[i].height};
    lens_of_photo.push_back(
        lenses.try_emplace(lens, static_cast<int>(lenses.size())).first->second);
  }
  return lens_of_photo;
}

}  // namespace semfoam
