// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/object_photos.h"

#include "foam/render/cell_shading.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace semfoam {
namespace {

constexpr int64_t kRaysPerBlock = 256;

// The photo's camera with as many pixels as are looked at.
Camera CoarseCamera(const PhotoRecord& photo, const std::filesystem::path& foam_path) {
  Camera camera = CameraOf(photo, foam_path);
  const double longer = std::max(photo.width, photo.height);
  if (longer <= kObjectSamplesAlongEdge) return camera;
  const auto reduced = [&](int size) {
    return static_cast<uint64_t>(
        std::max(1L, std::lround(size * kObjectSamplesAlongEdge / longer)));
  };
  return RescaledCamera(camera, reduced(photo.width), reduced(photo.height));
}

// A scene made ready for rays; it and the foam must outlive it.
struct Walker {
  Walker(const Foam& foam, const ExportableScene& scene)
      : scene(scene), density(CellDensities(foam)) {
    Refresh(scene.cell_positions, scene.delaunay, &geometry);
    // Without identities and gradients of colours: matter alone counts.
    shading = {foam.sh_degree, density.data(), foam.sh.data(), nullptr};
  }

  const ExportableScene& scene;
  const std::vector<float> density;
  WalkGeometry<float> geometry;
  CellShading<float> shading;
};

// For each ray the index of the object that it shows, or -1.
std::vector<int32_t> ShownObjects(const Walker& walker, const CameraRays& rays) {
  const ExportableScene& scene = walker.scene;
  const auto half_lost = static_cast<float>(std::log(2.0));
  const uint32_t start = NearestCell(scene.cell_positions, scene.delaunay, rays.origin, 0);
  std::vector<int32_t> shown(rays.directions.size(), -1);
  ParallelForBlocks(std::ssize(shown), kRaysPerBlock, [&](int64_t begin, int64_t end) {
    std::vector<int64_t> pixels;
    for (int64_t i = begin; i < end; ++i) {
      if (!rays.directions[i].isZero(0)) pixels.push_back(i);
    }
    const std::span<RayTrace> traces = ThreadTraces(pixels.size());
    for (size_t k = 0; k < pixels.size(); ++k) {
      traces[k].origin = rays.origin.cast<float>();
      traces[k].direction = rays.directions[pixels[k]];
      traces[k].start_cell = start;
    }
    TraceRays(walker.geometry, walker.shading, half_lost, traces);
    for (size_t k = 0; k < traces.size(); ++k) {
      for (int s = 0; s < traces[k].num_segments; ++s) {
        const RayTrace::Segment& p = traces[k].segments[s];
        if (p.tau_in + p.optical_depth < half_lost) continue;
        if (p.cell < scene.NumSites()) shown[pixels[k]] = scene.object_of_cell[p.cell];
        break;
      }
    }
  });
  return shown;
}

}  // namespace

void FindPhotosOfObjects(const Model& model,
                         const std::filesystem::path& foam_path,
                         ExportableScene* scene) {
  if (scene->objects.empty() || model.photos.empty()) return;
  const Walker walker(model.foam, *scene);
  std::vector<int64_t> samples(scene->objects.size());
  for (const PhotoRecord& photo : model.photos) {
    const CameraRays rays = MakeCameraRays(
        CoarseCamera(photo, foam_path), PoseOf(photo), scene->colmap_from_normalized);
    samples.assign(samples.size(), 0);
    for (const int32_t object : ShownObjects(walker, rays)) {
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
