// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view_renderer.h"

#include "foam/activation.h"
#include "foam/classifier.h"
#include "foam/guard_sites.h"
#include "foam/parallel.h"
#include "foam/ray_tracer.h"

#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Neighbouring pixels, traced together.
constexpr int64_t kRaysPerBlock = 256;

}  // namespace

std::vector<float> CellDensities(const Foam& foam) {
  std::vector<float> density(foam.NumSites() + kNumGuardSites, 0.f);
  ParallelForBlocks(foam.NumSites(), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) density[i] = Density(foam.raw_density[i]);
  });
  return density;
}

ViewRenderer::ViewRenderer(const Foam& foam) : foam_(foam), density_(CellDensities(foam)) {
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(foam.positions);
  delaunay_ = Triangulate(cells);
  Refresh(cells, delaunay_, &geometry_);
}

CellShading<float> ViewRenderer::shading() const {
  return {foam_.sh_degree,
          density_.data(),
          foam_.sh.data(),
          foam_.HasSemantics() ? foam_.identity.data() : nullptr};
}

uint32_t ViewRenderer::StartCell(const Eigen::Vector3d& origin) const {
  return NearestCell(geometry_.positions, delaunay_, origin, 0);
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
  view.class_index.assign(num_pixels, -1);
  view.confidence.assign(num_pixels, 0.f);

  const uint32_t start = StartCell(rays.origin);
  const CellShading<float> shading = this->shading();
  const float cutoff_tau = static_cast<float>(-std::log(kTransmittanceCutoff));
  ParallelForBlocks(num_pixels, kRaysPerBlock, [&](int64_t begin, int64_t end) {
    std::vector<int64_t> pixels;
    for (int64_t i = begin; i < end; ++i) {
      if (!rays.directions[i].isZero(0)) pixels.push_back(i);
    }
    const std::span<RayTrace> traces = ThreadTraces(pixels.size());
    for (size_t k = 0; k < pixels.size(); ++k) {
      traces[k].origin = rays.origin.cast<float>();
      traces[k].direction = rays.directions[pixels[k]];
      traces[k].start_cell = start;
      traces[k].quantile_tau[0] = std::log(2.f);
    }
    TraceRays(geometry_, shading, cutoff_tau, traces);
    std::vector<float> logits(foam_.num_classes);
    for (size_t k = 0; k < traces.size(); ++k) {
      CHECK(!traces[k].hit_step_limit) << "a ray walked in circles";
      const RayComposite<float>& ray = traces[k].composite;
      const int64_t i = pixels[k];
      const float transmittance = ray.Transmittance();
      view.color[i] =
          Eigen::Vector3f(ray.color[0], ray.color[1], ray.color[2]).array() + transmittance;
      view.opacity[i] = ray.Opacity();
      if (ray.quantile_piece[0] >= 0) view.distance[i] = ray.quantile_depth[0];
      if (foam_.HasSemantics() && view.opacity[i] >= 0.5f) {
        ClassLogits(foam_, ray.identity, logits.data());
        const MostLikelyClass best = ArgmaxSoftmax(logits);
        view.class_index[i] = best.class_index;
        view.confidence[i] = best.confidence;
      }
    }
  });
  return view;
}

}  // namespace semfoam
