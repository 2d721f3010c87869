// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view_renderer.h"

#include "foam/activation.h"
#include "foam/classifier.h"
#include "foam/guard_sites.h"
#include "foam/parallel.h"

#include <cmath>

#include <glog/logging.h>

namespace semfoam {

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
  ParallelForBlocks(num_pixels, 1024, [&](int64_t begin, int64_t end) {
    RayRecord<float> record;
    record.origin = rays.origin.cast<float>();
    std::vector<float> logits(foam_.num_classes);
    for (int64_t i = begin; i < end; ++i) {
      if (rays.directions[i].isZero(0)) continue;
      record.direction = rays.directions[i];
      record.composite = {};
      record.composite.quantile_tau[0] = std::log(2.f);
      TraceRay(geometry_, shading, start, cutoff_tau, &record);
      CHECK(!record.hit_step_limit) << "a ray walked in circles";
      const RayComposite<float>& ray = record.composite;
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
