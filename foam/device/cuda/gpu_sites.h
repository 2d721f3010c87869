// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/densification_kernels.h"
#include "foam/device/cuda/gpu_scene.h"
#include "foam/optim/densification.h"
#include "foam/optim/training_device.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <glog/logging.h>

namespace semfoam {

// The sites of a training in the memory of a GPU: the arrays of the optimiser and of densification;
// GpuScene holds those that rays read. Arrays are [N] unless another size is given.
template <typename Machine>
struct GpuSites {
  template <typename T>
  using Array = typename Machine::template Array<T>;

  Array<Eigen::Vector3f> positions;
  Array<float> raw_density;
  Array<float> first_moments, second_moments;  // [N][ParameterRow::size]
  Array<uint32_t> steps;
  Array<float> squared_error, contribution;  // DensificationStatistics

  void Upload(Machine& machine, TrainingState* state) {
    SendTo(machine, state->foam.positions, &positions);
    SendTo(machine, state->foam.raw_density, &raw_density);
    SendTo(machine, state->optimizer->first_moments(), &first_moments);
    SendTo(machine, state->optimizer->second_moments(), &second_moments);
    SendTo(machine, state->optimizer->steps(), &steps);
    SendTo(machine, state->densification.squared_error, &squared_error);
    SendTo(machine, state->densification.contribution, &contribution);
  }
  // Copies everything but positions and statistics to the host.
  void DownloadLearned(Machine& machine, TrainingState* state) const {
    FetchFrom(machine, raw_density, &state->foam.raw_density);
    FetchFrom(machine, first_moments, &state->optimizer->first_moments());
    FetchFrom(machine, second_moments, &state->optimizer->second_moments());
    FetchFrom(machine, steps, &state->optimizer->steps());
  }
  void DownloadSites(Machine& machine, TrainingState* state) const {
    FetchFrom(machine, positions, &state->foam.positions);
    FetchFrom(machine, squared_error, &state->densification.squared_error);
    FetchFrom(machine, contribution, &state->densification.contribution);
  }

  // Executes a densification, also of the colours and identities of `scene`, whose
  // densities and topology the caller must update next. Holds the old and the new version of one
  // array at a time.
  void Rearrange(Machine& machine, const Rearrangement& plan, GpuScene<Machine>* scene) {
    const size_t old_count = positions.size(), count = plan.origin.size();
    CHECK_EQ(plan.is_new.size(), count);
    CHECK_EQ(plan.positions.size(), count);
    for (const uint32_t i : plan.origin) CHECK_LT(i, old_count);
    machine.ForEach(old_count,
                    FadeUnseen{contribution.data(),
                               DensificationOptions().transparent_contribution,
                               positions.data(),
                               raw_density.data()});
    Array<uint32_t> origin;
    Array<uint8_t> is_new;
    SendTo(machine, plan.origin, &origin);
    SendTo(machine, plan.is_new, &is_new);
    Array<Eigen::Vector3f> planned;
    SendTo(machine, plan.positions, &planned);
    // Leaves an empty array empty. `is_zero` marks rows to fill with zeros, or is null.
    const auto gather = [&]<typename T>(Array<T>* values, const uint8_t* is_zero) {
      CHECK_EQ(values->size() % old_count, 0u);
      const int stride = static_cast<int>(values->size() / old_count);
      Array<T> gathered;
      gathered.Resize(count * stride);
      machine.ForEach(
          gathered.size(),
          GatherRows<T>{origin.data(), is_zero, stride, values->data(), gathered.data()});
      using std::swap;
      swap(*values, gathered);
    };
    gather(&raw_density, nullptr);
    gather(&positions, nullptr);
    gather(&scene->sh, nullptr);
    gather(&scene->color_gradient, nullptr);
    const int sh_stride = static_cast<int>(scene->sh.size() / count);
    machine.ForEach(
        count,
        PlaceSite{is_new.data(),
                  planned.data(),
                  scene->color_gradient.size() > 0 ? scene->color_gradient.data() : nullptr,
                  sh_stride,
                  positions.data(),
                  scene->sh.data()});
    gather(&scene->identity, nullptr);
    gather(&first_moments, is_new.data());
    gather(&second_moments, is_new.data());
    gather(&steps, is_new.data());
    for (Array<float>* sums : {&squared_error, &contribution}) {
      sums->Resize(count);
      machine.Clear(sums);
    }
  }
};

}  // namespace semfoam
