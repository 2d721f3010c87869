// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/cuda_device.h"
#include "foam/device/cuda/gpu_training.h"
#include "foam/device/cuda/host_machine.h"
#include "foam/geometry/guard_sites.h"
#include "foam/optim/training_device.h"
#include "foam/util/ids.h"
#include "foam/util/random.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "tests/foam/random_cells.h"
#include "tests/foam/render/ray_replay.h"
#include <glog/logging.h>
#include <gtest/gtest.h>

// A GPU and foams to train on it. What its kernels do is also run on the CPU:
// the same source that nvcc compiles, but for launching, memory, sorting and prefix sums. Where
// there is no GPU, the tests that need one are skipped and say so.

namespace semfoam {

// Why a test that needs a GPU cannot run; empty if it can.
inline std::string WhyNoGpu() {
#ifdef SEMFOAM_HAS_CUDA
  return NumCudaDevices() > 0 ? "" : "there is no NVIDIA GPU, or no driver for it";
#else
  return "built without CUDA";
#endif
}

// On "cuda", the first GPU, or on "cpu", the kernels without one.
inline std::unique_ptr<TrainingDevice> MakeGpu(const std::string& kind, TrainingState* state) {
#ifdef SEMFOAM_HAS_CUDA
  if (kind == "cuda") return MakeCudaTrainingDevice(0, state);
#endif
  CHECK_EQ(kind, "cpu");
  return std::make_unique<GpuTraining<HostMachine>>(state);
}

struct Scene {
  int sh_degree = 2;
  int num_classes = 5;
  double identity_to_density = 0.3;
  double tv_weight = 0.1;
  bool color_gradients = true;
  double color_tv_weight = 0.1;
};

// A foam in the middle of a training: random parameters, moments of earlier steps.
inline std::unique_ptr<TrainingState> MakeState(const std::vector<Eigen::Vector3f>& sites,
                                                const Scene& scene) {
  auto state = std::make_unique<TrainingState>();
  Foam& foam = state->foam;
  foam.sh_degree = scene.sh_degree;
  foam.num_classes = scene.num_classes;
  foam.positions = sites;
  const FoamParameters<float> values =
      RandomParameters(WithGuardSites(sites), sites.size(), scene.sh_degree, scene.num_classes, 5);
  foam.raw_density.assign(values.raw_density.begin(), values.raw_density.end());
  // What is saturated has gradients beyond the resolution of floats.
  for (float& raw : foam.raw_density) raw = std::clamp(raw, kLowestRawDensity, 0.5f);
  foam.sh.assign(values.sh.begin(), values.sh.end());
  if (scene.num_classes > 0) foam.identity.assign(values.identity.begin(), values.identity.end());
  if (scene.color_gradients) {
    foam.color_gradient.assign(values.color_gradient.begin(), values.color_gradient.end());
  }
  foam.classifier_weight = values.weight;
  foam.classifier_bias = values.bias;
  state->optimizer = std::make_unique<FoamOptimizer>(foam);
  state->densification.Reset(sites.size());
  state->topology.Triangulate(
      sites, FreeSpace(), scene.num_classes > 0 || scene.color_tv_weight > 0);
  return state;
}

inline std::vector<BatchRay> RandomRays(const TrainingState& state, int count) {
  std::vector<BatchRay> rays;
  for (int i = 0; i < count; ++i) {
    CounterRandom random(23, 0x54, i);
    BatchRay& ray = rays.emplace_back();
    const Eigen::Vector3d origin = RandomPoint(&random, 1.5);
    ray.origin = origin.cast<float>();
    ray.direction = RandomDirection(&random).cast<float>();
    ray.start_cell = state.topology.CellAt(origin, 0);
    ray.quantile_tau[0] = 0.3f;
    ray.quantile_tau[1] = 1.2f;
    ray.target = {
        {0.2f, 0.9f, 0.4f},
        state.foam.num_classes == 0 || i % 4 == 3 ? Value(kUnlabelled) : i % state.foam.num_classes,
        i % 3 == 0 ? 0.f : 0.8f};
  }
  return rays;
}

inline TrainingStep StepFor(const std::vector<BatchRay>& rays, const Scene& scene) {
  const bool semantics = scene.num_classes > 0;
  RayLossWeights weights;
  weights.quantile = 0.01;
  weights.distance = 0.1;
  weights.identity_to_density = semantics ? scene.identity_to_density : 0;
  return {rays,
          weights,
          6.9f,
          semantics ? scene.tv_weight : 0,
          scene.color_tv_weight,
          {1e-3f, 2e-3f, 3e-3f, 4e-3f, 5e-3f, 6e-3f, 7e-3f}};
}

inline std::vector<float> Coordinates(const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> values;
  for (const Eigen::Vector3f& p : points) values.insert(values.end(), p.data(), p.data() + 3);
  return values;
}

class GpuTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "cuda" && !WhyNoGpu().empty()) GTEST_SKIP() << WhyNoGpu();
  }
  std::unique_ptr<TrainingDevice> MakeTraining(TrainingState* state) const {
    return MakeGpu(GetParam(), state);
  }
};

}  // namespace semfoam
