// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/gpu_scene.h"
#include "foam/render/ray_caster.h"

#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

// Renders a foam that is on a GPU (Machine: CudaMachine; HostMachine in tests).
template <typename Machine>
class GpuCaster : public RayCaster {
 public:
  template <typename... Arguments>
  GpuCaster(const WalkGeometry<float>& geometry,
            const CellShading<float>& shading,
            const ClassifierView<float>& classifier,
            Arguments&&... arguments)
      : machine_(std::forward<Arguments>(arguments)...),
        num_sites_(geometry.num_sites),
        sh_degree_(shading.sh_degree),
        num_classes_(classifier.num_classes) {
    scene_.Send(machine_, geometry);
    scene_.Send(machine_, shading, classifier, num_sites_);
  }

  std::vector<RenderedRay> Render(std::span<const RayQuery> rays) const override {
    const std::lock_guard lock(mutex_);
    bool hit_step_limit = false;
    std::vector<RenderedRay> rendered = renderer_.Render(machine_,
                                                         scene_.Geometry(num_sites_),
                                                         scene_.Shading(sh_degree_),
                                                         scene_.Classes(num_classes_),
                                                         rays,
                                                         &hit_step_limit);
    CHECK(!hit_step_limit) << "rays walked in circles";
    return rendered;
  }

 private:
  mutable std::mutex mutex_;
  mutable Machine machine_;
  mutable GpuRenderer<Machine, RayQuery> renderer_;
  GpuScene<Machine> scene_;
  uint32_t num_sites_;
  int sh_degree_;
  int num_classes_;
};

}  // namespace semfoam
