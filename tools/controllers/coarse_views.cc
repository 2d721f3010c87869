// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/coarse_views.h"

#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"
#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace semfoam {
namespace {

constexpr int64_t kRaysPerBlock = 256;

}  // namespace

Camera CoarseCamera(const PhotoRecord& photo,
                    double max_size,
                    const std::filesystem::path& foam_path) {
  Camera camera = CameraOf(photo, foam_path);
  const double longer_side = std::max(photo.width, photo.height);
  if (longer_side <= max_size) return camera;
  const auto reduced = [&](int size) {
    return static_cast<uint64_t>(std::max(1L, std::lround(size * max_size / longer_side)));
  };
  return RescaledCamera(camera, reduced(photo.width), reduced(photo.height));
}

CoarseViews::CoarseViews(const Foam& foam, const ExportableScene& scene)
    : scene_(scene), density_(CellDensities(foam)) {
  Refresh(scene.cell_positions, scene.delaunay, &geometry_);
  // Without identities and gradients of colours: matter alone counts.
  shading_ = {foam.sh_degree, density_.data(), foam.sh.data(), nullptr};
}

std::vector<CoarseViews::Stop> CoarseViews::Look(const CameraRays& rays) const {
  const auto half_lost = static_cast<float>(std::log(2.0));
  const uint32_t start = NearestCell(scene_.cell_positions, scene_.delaunay, rays.origin, 0);
  std::vector<Stop> stops(rays.directions.size());
  ParallelForBlocks(std::ssize(stops), kRaysPerBlock, [&](int64_t begin, int64_t end) {
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
    TraceRays(geometry_, shading_, half_lost, traces);
    for (size_t k = 0; k < traces.size(); ++k) {
      for (int s = 0; s < traces[k].num_segments; ++s) {
        const RayTrace::Segment& p = traces[k].segments[s];
        if (p.tau_in + p.optical_depth < half_lost) continue;
        if (p.cell < scene_.NumSites()) stops[pixels[k]] = {p.cell, p.t_out};
        break;
      }
    }
  });
  return stops;
}

float FarthestVisible(const CoarseDistances& view, int x, int y, bool keeps_off_outlines) {
  constexpr float kStep = 0.95f;
  float farthest = 0, nearest = std::numeric_limits<float>::infinity();
  for (int ny = std::max(0, y - 1); ny <= std::min(view.height - 1, y + 1); ++ny) {
    for (int nx = std::max(0, x - 1); nx <= std::min(view.width - 1, x + 1); ++nx) {
      const float distance = view.distance[static_cast<size_t>(ny) * view.width + nx];
      farthest = std::max(farthest, distance);
      nearest = std::min(nearest, distance);
    }
  }
  return keeps_off_outlines && nearest < kStep * farthest ? nearest : farthest;
}

}  // namespace semfoam
