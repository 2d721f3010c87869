// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/object_photos.h"

#include "plugin/colmap/camera_rays.h"
#include "tools/controllers/coarse_views.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace semfoam {

void FindPhotosOfObjects(const Model& model,
                         const std::filesystem::path& foam_path,
                         ExportableScene* scene) {
  if (scene->objects.empty() || model.photos.empty()) return;
  const CoarseViews views(model.foam, *scene);
  std::vector<int64_t> samples(scene->objects.size());
  for (const PhotoRecord& photo : model.photos) {
    const CameraRays rays = MakeCameraRays(CoarseCamera(photo, kObjectSamplesAlongEdge, foam_path),
                                           PoseOf(photo),
                                           scene->colmap_from_normalized);
    samples.assign(samples.size(), 0);
    for (const CoarseViews::Stop& stop : views.Look(rays)) {
      if (stop.cell == kNoCell) continue;
      const int32_t object = scene->object_of_cell[stop.cell];
      if (object >= 0) ++samples[object];
    }
    const double pixels_per_sample = static_cast<double>(photo.width) * photo.height /
                                     static_cast<double>(rays.directions.size());
    for (size_t k = 0; k < samples.size(); ++k) {
      if (samples[k] == 0) continue;
      scene->objects[k].photos.push_back(
          {photo.name, std::lround(static_cast<double>(samples[k]) * pixels_per_sample)});
    }
  }
  for (ObjectInfo& object : scene->objects) {
    std::stable_sort(
        object.photos.begin(),
        object.photos.end(),
        [](const PhotoObservation& a, const PhotoObservation& b) { return a.pixels > b.pixels; });
  }
}

}  // namespace semfoam
