// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/render_kernels.h"
#include "foam/geometry/guard_sites.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace semfoam {

// Copy values to an array of a GPU and back; the target is resized to their number.
template <typename Machine, typename Vector, typename Array>
void SendTo(Machine& machine, const Vector& values, Array* array) {
  array->Resize(values.size());
  if (!values.empty()) machine.Upload(values.data(), values.size(), array);
}
template <typename Machine, typename Array, typename Vector>
void FetchFrom(Machine& machine, const Array& array, Vector* values) {
  values->resize(array.size());
  machine.Download(array, array.size(), values->data());
}

// The arrays of a foam that rays read, in the memory of a GPU.
template <typename Machine>
struct GpuScene {
  template <typename T>
  using Array = typename Machine::template Array<T>;

  Array<Eigen::Vector3f> positions;  // [num_cells] of the planes
  Array<uint32_t> first_block;       // as in WalkGeometry
  Array<PlaneBlock<float>> blocks;
  Array<uint32_t> cell_of_block;
  Array<uint8_t> has_twin;                    // [num_cells] scratch of a refresh
  Array<float> density;                       // [num_cells]
  Array<float> sh, identity, color_gradient;  // as in CellShading
  Array<float> class_weight, class_bias;

  WalkView<float> Geometry(uint32_t num_sites) const {
    return {positions.data(),
            first_block.data(),
            blocks.data(),
            num_sites,
            static_cast<uint32_t>(positions.size())};
  }
  CellShading<float> Shading(int sh_degree) const {
    return {sh_degree,
            density.data(),
            sh.data(),
            identity.size() > 0 ? identity.data() : nullptr,
            color_gradient.size() > 0 ? color_gradient.data() : nullptr};
  }
  ClassifierView<float> Classes(int num_classes) const {
    return {num_classes, class_weight.data(), class_bias.data()};
  }

  void Send(Machine& machine, const WalkGeometry<float>& geometry) {
    const size_t num_cells = geometry.positions.size();
    std::vector<uint32_t> cells(geometry.blocks.size());
    for (size_t i = 0; i < num_cells; ++i) {
      std::fill(cells.begin() + geometry.first_block[i],
                cells.begin() + geometry.first_block[i + 1],
                static_cast<uint32_t>(i));
    }
    SendTo(machine, geometry.positions, &positions);
    SendTo(machine, geometry.first_block, &first_block);
    SendTo(machine, geometry.blocks, &blocks);
    SendTo(machine, cells, &cell_of_block);
  }
  void Send(Machine& machine, const ClassifierView<float>& classes) {
    const size_t k = classes.num_classes;
    SendTo(machine, std::span(classes.weight, k * kIdentityDim), &class_weight);
    SendTo(machine, std::span(classes.bias, k), &class_bias);
  }
  void Send(Machine& machine,
            const CellShading<float>& shading,
            const ClassifierView<float>& classes,
            size_t num_sites) {
    const size_t num_coefficients = 3 * NumShCoefficients(shading.sh_degree);
    SendTo(machine, std::span(shading.density, num_sites + kNumGuardSites), &density);
    SendTo(machine, std::span(shading.sh, num_sites * num_coefficients), &sh);
    const size_t num_channels = shading.identity != nullptr ? num_sites * kIdentityDim : 0;
    SendTo(machine, std::span(shading.identity, num_channels), &identity);
    const size_t num_gradients =
        shading.color_gradient != nullptr ? num_sites * kColorGradientDim : 0;
    SendTo(machine, std::span(shading.color_gradient, num_gradients), &color_gradient);
    Send(machine, classes);
  }
};

// Renders rays of a scene that is on the GPU. `Ray` is that of RenderRay.
template <typename Machine, typename Ray>
class GpuRenderer {
 public:
  // Returns in `hit_step_limit` whether any ray hit the step limit.
  std::vector<RenderedRay> Render(Machine& machine,
                                  const WalkView<float>& geometry,
                                  const CellShading<float>& shading,
                                  const ClassifierView<float>& classifier,
                                  std::span<const Ray> rays,
                                  bool* hit_step_limit) {
    std::vector<RenderedRay> rendered(rays.size());
    any_step_limit_hit_.Resize(1);
    machine.Clear(&any_step_limit_hit_);
    for (size_t begin = 0; begin < rays.size(); begin += kRaysAtATime) {
      const size_t count = std::min(kRaysAtATime, rays.size() - begin);
      rays_.Resize(count);
      shown_.Resize(count);
      machine.Upload(rays.data() + begin, count, &rays_);
      machine.ForEach(count,
                      RenderRay<Ray>{geometry,
                                     shading,
                                     classifier,
                                     static_cast<float>(-std::log(kTransmittanceCutoff)),
                                     rays_.data(),
                                     shown_.data(),
                                     any_step_limit_hit_.data()});
      machine.Download(shown_, count, rendered.data() + begin);
    }
    uint8_t hit = 0;
    machine.Download(any_step_limit_hit_, 1, &hit);
    *hit_step_limit = hit != 0;
    return rendered;
  }

 private:
  static constexpr size_t kRaysAtATime = size_t{1} << 21;

  typename Machine::template Array<Ray> rays_;
  typename Machine::template Array<RenderedRay> shown_;
  typename Machine::template Array<uint8_t> any_step_limit_hit_;
};

}  // namespace semfoam
