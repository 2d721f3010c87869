// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/ray_tables.h"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <utility>

namespace semfoam {
namespace {

constexpr uint64_t kMaxTableBytes = uint64_t{1} << 30;

Camera CameraOfView(const PhotoRecord& photo) { return CameraOf(photo, "the scene"); }

// Views whose rays are the same have the same key.
using CameraKey = std::tuple<std::string, int, int, std::vector<double>>;
CameraKey KeyOf(const PhotoRecord& photo) {
  return {photo.camera_model, photo.width, photo.height, photo.camera_params};
}

}  // namespace

std::vector<int> ChooseTables(const std::vector<PhotoRecord>& photos) {
  std::map<CameraKey, std::pair<int, int>> uses;  // first view, number of views
  for (int view = 0; view < static_cast<int>(photos.size()); ++view) {
    ++uses.try_emplace(KeyOf(photos[view]), view, 0).first->second.second;
  }
  std::vector<std::pair<int, int>> order;
  order.reserve(uses.size());
  for (const auto& [key, use] : uses) order.push_back(use);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  std::vector<int> views;
  uint64_t total = 0;
  for (const auto& [first_view, count] : order) {
    const uint64_t bytes = PixelRays::TableBytes(CameraOfView(photos[first_view]));
    if (bytes == 0 || total + bytes > kMaxTableBytes) continue;
    total += bytes;
    views.push_back(first_view);
  }
  return views;
}

uint64_t RayTableBytes(const std::vector<PhotoRecord>& photos,
                       const std::vector<int>& table_views) {
  uint64_t bytes = 0;
  for (const int view : table_views) bytes += PixelRays::TableBytes(CameraOfView(photos[view]));
  return bytes;
}

std::vector<std::shared_ptr<const PixelRays>> MakePhotoRays(const std::vector<PhotoRecord>& photos,
                                                            const std::vector<int>& table_views) {
  std::map<CameraKey, std::shared_ptr<const PixelRays>> shared;
  for (const int view : table_views) {
    shared[KeyOf(photos[view])] =
        std::make_shared<PixelRays>(CameraOfView(photos[view]), /*tabulate=*/true);
  }
  std::vector<std::shared_ptr<const PixelRays>> rays;
  rays.reserve(photos.size());
  for (const PhotoRecord& photo : photos) {
    std::shared_ptr<const PixelRays>& of_camera = shared[KeyOf(photo)];
    if (!of_camera) {
      of_camera = std::make_shared<PixelRays>(CameraOfView(photo), /*tabulate=*/false);
    }
    rays.push_back(of_camera);
  }
  return rays;
}

}  // namespace semfoam
