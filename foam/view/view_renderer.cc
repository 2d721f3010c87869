// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/view_renderer.h"

#include "foam/device/device_factory.h"
#include "foam/geometry/guard_sites.h"
#include "foam/render/cell_shading.h"
#include "foam/util/parallel.h"

#include <algorithm>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Pixels cast together: enough to fill any device, few enough to be no matter of memory.
constexpr size_t kPixelsAtOnce = size_t{1} << 20;

}  // namespace

ViewRenderer::ViewRenderer(const Foam& foam, const Device& device)
    : foam_(foam), device_(device), density_(CellDensities(foam)) {
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(foam.positions);
  delaunay_ = Triangulate(cells);
  Refresh(cells, delaunay_, &geometry_);
}

CellShading<float> ViewRenderer::shading() const { return ShadingOf(foam_, density_); }

uint32_t ViewRenderer::StartCell(const Eigen::Vector3d& origin) const {
  return NearestCell(geometry_.positions, delaunay_, origin, 0);
}

const RayCaster& ViewRenderer::Caster() const {
  std::call_once(caster_is_made_, [&] {
    caster_ = MakeRayCaster(device_, geometry_, shading(), ClassifierOf(foam_));
  });
  return *caster_;
}

RenderedView ViewRenderer::Render(const CameraRays& rays) const {
  const size_t num_pixels = size_t(rays.width) * rays.height;
  CHECK_EQ(rays.directions.size(), num_pixels);
  RenderedView view;
  view.width = rays.width;
  view.height = rays.height;
  view.color.assign(num_pixels, Eigen::Vector3f::Ones());
  view.opacity.assign(num_pixels, 0.f);
  view.distance.assign(num_pixels, 0.f);
  view.class_index.assign(num_pixels, kUnlabelled);
  view.confidence.assign(num_pixels, 0.f);

  const uint32_t start = StartCell(rays.origin);
  const Eigen::Vector3f origin = rays.origin.cast<float>();
  std::vector<size_t> pixels;
  std::vector<RayQuery> queries;
  for (size_t first = 0; first < num_pixels; first += kPixelsAtOnce) {
    pixels.clear();
    queries.clear();
    for (size_t i = first; i < std::min(num_pixels, first + kPixelsAtOnce); ++i) {
      if (rays.directions[i].isZero(0)) continue;
      pixels.push_back(i);
      queries.push_back({origin, rays.directions[i], start});
    }
    const std::vector<RenderedRay> rendered = Caster().Render(queries);
    ParallelForBlocks(pixels.size(), 4096, [&](int64_t begin, int64_t end) {
      for (int64_t k = begin; k < end; ++k) {
        const size_t i = pixels[k];
        view.color[i] = rendered[k].color;
        view.opacity[i] = rendered[k].opacity;
        view.distance[i] = rendered[k].distance;
        view.class_index[i] = ClassIndex{rendered[k].class_index};
        view.confidence[i] = rendered[k].confidence;
      }
    });
  }
  return view;
}

}  // namespace semfoam
