// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/shared_counter.h"
#include "foam/model/classifier.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/util/host_device.h"

#include <cmath>
#include <cstdint>

namespace semfoam {

// Renders a ray. `Ray` has an origin, a direction and a start_cell. Thread: ray.
template <typename Ray>
struct RenderRay {
  WalkView<float> geometry;
  CellShading<float> shading;
  ClassifierView<float> classifier;
  float cutoff_tau;
  const Ray* rays;

  RenderedRay* rendered;
  uint8_t* any_step_limit_hit;  // one, zero before

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    RayWithoutRecord<float> ray;
    ray.origin = rays[i].origin;
    ray.direction = rays[i].direction;
    ray.composite = {};
    ray.composite.quantile_tau[0] = std::log(2.f);
    TraceRay(geometry, shading, rays[i].start_cell, cutoff_tau, &ray);
    if (ray.hit_step_limit) Raise(any_step_limit_hit);
    RenderedRay out;
    const float transmittance = ray.composite.Transmittance();
    for (int c = 0; c < 3; ++c) out.color[c] = ray.composite.color[c] + transmittance;
    out.opacity = ray.composite.Opacity();
    if (ray.composite.quantile_segment[0] >= 0) out.distance = ray.composite.quantile_depth[0];
    if (classifier.num_classes > 0 && out.opacity >= 0.5f) {
      const MostLikelyClass best = FindMostLikelyClass(
          classifier.weight, classifier.bias, classifier.num_classes, ray.composite.identity);
      out.class_index = best.class_index;
      out.confidence = best.confidence;
    }
    rendered[i] = out;
  }
};

// Copies the first SH coefficients of each site. Thread: value of the result.
struct TakeLowerSh {
  const float* sh;
  int stride;        // of a site in `sh`
  int lower_stride;  // in the result, less
  float* lower_sh;

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    lower_sh[t] = sh[t / lower_stride * stride + t % lower_stride];
  }
};

}  // namespace semfoam
