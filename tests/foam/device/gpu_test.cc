// SPDX-License-Identifier: GPL-3.0-or-later
//
// A step on a GPU against the fast path of the CPU.
#include "foam/device/cpu_device.h"
#include "foam/device/cuda/cuda_device.h"
#include "foam/device/cuda/gpu_caster.h"
#include "foam/device/cuda/host_machine.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"
#include "foam/view/view_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "tests/foam/device/gpu_states.h"
#include "tests/foam/foam_digest.h"
#include <glog/logging.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

std::unique_ptr<RayCaster> MakeGpuCaster(const std::string& kind,
                                         const WalkGeometry<float>& geometry,
                                         const CellShading<float>& shading,
                                         const ClassifierView<float>& classifier) {
#ifdef SEMFOAM_HAS_CUDA
  if (kind == "cuda") return MakeCudaRayCaster(0, geometry, shading, classifier);
#endif
  CHECK_EQ(kind, "cpu");
  return std::make_unique<GpuCaster<HostMachine>>(geometry, shading, classifier);
}

// |a - b| of all values against the largest of them.
template <typename Vector>
void ExpectNear(const Vector& a, const Vector& b, double bound, const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  double largest = 1e-30, deviation = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::abs(double(b[i])));
    deviation = std::max(deviation, std::abs(double(a[i]) - double(b[i])));
  }
  EXPECT_LE(deviation, bound * largest) << what;
}

void ExpectSameTotals(const BatchTotals& gpu, const BatchTotals& cpu) {
  // The walk takes the very same steps.
  EXPECT_EQ(gpu.num_segments, cpu.num_segments);
  EXPECT_EQ(gpu.clamped_segments, cpu.clamped_segments);
  EXPECT_EQ(gpu.step_limit_hits, cpu.step_limit_hits);
  const auto near = [](double a, double b) { EXPECT_NEAR(a, b, 1e-5 * std::abs(b)); };
  near(gpu.mean_loss.color, cpu.mean_loss.color);
  near(gpu.mean_loss.opacity, cpu.mean_loss.opacity);
  near(gpu.mean_loss.quantile, cpu.mean_loss.quantile);
  near(gpu.mean_loss.identity, cpu.mean_loss.identity);
}

class GpuStep : public testing::TestWithParam<std::tuple<std::string, Scene>> {
 protected:
  void SetUp() override {
    if (std::get<0>(GetParam()) == "cuda" && !WhyNoGpu().empty()) GTEST_SKIP() << WhyNoGpu();
  }
  std::unique_ptr<TrainingDevice> MakeTraining(TrainingState* state) const {
    return MakeGpu(std::get<0>(GetParam()), state);
  }
  const Scene& scene() const { return std::get<1>(GetParam()); }
};

// After the first step the moments are a tenth of the gradient: all of it is compared.
TEST_P(GpuStep, HasTheGradientsOfTheCores) {
  const std::vector<Eigen::Vector3f> sites = RandomSites(300, 31);
  const auto on_cpu = MakeState(sites, scene()), on_gpu = MakeState(sites, scene());
  const std::vector<BatchRay> rays = RandomRays(*on_cpu, 700);
  const auto cpu = MakeCpuTrainingDevice(on_cpu.get());
  const auto gpu = MakeTraining(on_gpu.get());
  for (TrainingDevice* device : {cpu.get(), gpu.get()}) {
    device->Upload();
    device->UploadTopology();
  }
  const TrainingStep step = StepFor(rays, scene());
  const TrainingStepResult expected = cpu->Step(step), result = gpu->Step(step);
  gpu->Download();
  ExpectSameTotals(result.batch, expected.batch);
  EXPECT_NEAR(result.tv_loss, expected.tv_loss, 1e-5 * expected.tv_loss);
  EXPECT_EQ(result.skipped_updates, 0);
  EXPECT_EQ(expected.tv_loss > 0, scene().num_classes > 0 && scene().tv_weight > 0);

  const ParameterRow row = on_cpu->optimizer->row();
  const auto column = [&](const auto& rows, int begin, int end) {
    std::vector<float> values;
    for (size_t i = 0; i < sites.size(); ++i) {
      for (int p = begin; p < end; ++p) values.push_back(rows[i * row.size + p]);
    }
    return values;
  };
  const auto& m = on_gpu->optimizer->first_moments();
  const auto& n = on_cpu->optimizer->first_moments();
  ExpectNear(column(m, 0, row.position), column(n, 0, row.position), 1e-5, "identity");
  ExpectNear(
      column(m, row.position, row.density), column(n, row.position, row.density), 1e-4, "position");
  const int density_end = row.density + 1;
  ExpectNear(
      column(m, row.density, density_end), column(n, row.density, density_end), 1e-4, "density");
  ExpectNear(column(m, row.color_gradient, row.sh),
             column(n, row.color_gradient, row.sh),
             1e-4,
             "colour gradient");
  ExpectNear(column(m, row.sh, row.size), column(n, row.sh, row.size), 1e-5, "SH");
  EXPECT_EQ(on_gpu->optimizer->steps(), on_cpu->optimizer->steps());
  ExpectNear(on_gpu->densification.squared_error,
             on_cpu->densification.squared_error,
             1e-4,
             "squared error");
  ExpectNear(
      on_gpu->densification.contribution, on_cpu->densification.contribution, 1e-5, "contribution");
  ExpectNear(on_gpu->foam.classifier_weight, on_cpu->foam.classifier_weight, 1e-5, "classifier");
  ExpectNear(on_gpu->foam.classifier_bias, on_cpu->foam.classifier_bias, 1e-5, "classifier");
}

// Adam's steps, over several of them: of the size of the learning rates, so that a few that are
// wrong by their sign alone, where the gradient is nothing but rounding, are seen as such.
TEST_P(GpuStep, MovesTheFoamAsTheCoresDo) {
  const std::vector<Eigen::Vector3f> sites = RandomSites(300, 32);
  const auto on_cpu = MakeState(sites, scene()), on_gpu = MakeState(sites, scene());
  const auto cpu = MakeCpuTrainingDevice(on_cpu.get());
  const auto gpu = MakeTraining(on_gpu.get());
  for (TrainingDevice* device : {cpu.get(), gpu.get()}) {
    device->Upload();
    device->UploadTopology();
    for (int k = 0; k < 3; ++k) {
      const std::vector<BatchRay> rays = RandomRays(*on_cpu, 300 + 100 * k);
      Scene with_or_without = scene();
      with_or_without.tv_weight *= k != 1;
      with_or_without.color_tv_weight *= k != 1;
      device->Step(StepFor(rays, with_or_without));
      device->RefreshPlanes();
    }
    device->Download();
  }
  const auto share_of_same = [](const auto& a, const auto& b, double bound) {
    size_t same = 0;
    for (size_t i = 0; i < a.size(); ++i) same += std::abs(double(a[i]) - double(b[i])) <= bound;
    return a.size() == b.size() ? double(same) / std::max<size_t>(a.size(), 1) : 0.0;
  };
  const Foam &a = on_gpu->foam, &b = on_cpu->foam;
  EXPECT_GT(share_of_same(Coordinates(a.positions), Coordinates(b.positions), 1e-5), 0.99);
  EXPECT_GT(share_of_same(a.raw_density, b.raw_density, 1e-4), 0.99);
  EXPECT_GT(share_of_same(a.sh, b.sh, 1e-4), 0.99);
  EXPECT_EQ(a.HasColorGradients(), scene().color_gradients);
  if (a.HasColorGradients()) {
    EXPECT_GT(share_of_same(a.color_gradient, b.color_gradient, 1e-4), 0.99);
  }
  EXPECT_GT(a.identity.empty() ? 1 : share_of_same(a.identity, b.identity, 1e-4), 0.99);
  EXPECT_NE(Coordinates(a.positions), Coordinates(sites)) << "nothing has moved";
}

INSTANTIATE_TEST_SUITE_P(Scenes,
                         GpuStep,
                         testing::Combine(testing::Values("cpu", "cuda"),
                                          testing::Values(Scene{},
                                                          Scene{0, 5, 0, 0.1},
                                                          Scene{3, 0, 0, 0},
                                                          Scene{1, 1, 1, 0, true, 0},
                                                          Scene{2, 5, 0.3, 0.1, false},
                                                          Scene{2, 700, 0, 0.1})));
class GpuBasics : public GpuTest {};

INSTANTIATE_TEST_SUITE_P(Kinds, GpuBasics, testing::Values("cpu", "cuda"));

TEST_P(GpuBasics, GivesTheSameBytesOnAnyNumberOfThreads) {
  const std::vector<Eigen::Vector3f> sites = RandomSites(200, 33);
  std::vector<uint64_t> digests;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const auto state = MakeState(sites, {});
    const std::vector<BatchRay> rays = RandomRays(*state, 900);
    const auto gpu = MakeTraining(state.get());
    gpu->Upload();
    gpu->UploadTopology();
    for (int k = 0; k < 3; ++k) gpu->Step(StepFor(rays, {}));
    gpu->Download();
    uint64_t digest = DigestOf(state->foam.positions, 0);
    digest = DigestOf(state->foam.sh, digest);
    digest = DigestOf(state->foam.identity, digest);
    digest = DigestOf(state->foam.classifier_weight, digest);
    digests.push_back(DigestOf(state->optimizer->second_moments(), digest));
  }
  EXPECT_EQ(digests[0], digests[1]);
  EXPECT_EQ(digests[0], digests[2]);
}

// The first pool has room for some hundred segments a ray. Along a row of a thousand cells it is
// too small, and the batch is cast anew.
TEST_P(GpuBasics, LongRaysFindRoom) {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < 1000; ++i) {
    CounterRandom random(34, 0x55, i);
    sites.push_back({-1 + 0.002f * i,
                     static_cast<float>(1e-4 * random.Uniform()),
                     static_cast<float>(1e-4 * random.Uniform())});
  }
  const auto on_cpu = MakeState(sites, {}), on_gpu = MakeState(sites, {});
  for (TrainingState* state : {on_cpu.get(), on_gpu.get()}) {
    for (float& raw : state->foam.raw_density) raw = -0.5f;  // thin
  }
  std::vector<BatchRay> rays = RandomRays(*on_cpu, 64);
  for (BatchRay& ray : rays) {
    ray.origin = {-1.1f, 0, 0};
    ray.direction = {1, 0, 0};
    ray.start_cell = on_cpu->topology.CellAt(ray.origin.cast<double>(), 0);
  }
  const auto cpu = MakeCpuTrainingDevice(on_cpu.get());
  const auto gpu = MakeTraining(on_gpu.get());
  for (TrainingDevice* device : {cpu.get(), gpu.get()}) {
    device->Upload();
    device->UploadTopology();
  }
  const TrainingStepResult expected = cpu->Step(StepFor(rays, {})),
                           result = gpu->Step(StepFor(rays, {}));
  EXPECT_GT(expected.batch.num_segments, 64 * 900);
  ExpectSameTotals(result.batch, expected.batch);
}

// Planes as Refresh makes them, bit for bit, sites that are hardly apart and their neighbours left
// to double included.
TEST_P(GpuBasics, PlanesFollowTheSites) {
  std::vector<Eigen::Vector3f> sites = RandomSites(400, 35);
  for (int i = 0; i < 20; ++i) {
    sites.push_back(sites[i]);
    sites.back()[0] = std::nextafter(sites[i][0], 2.f);
  }
  const auto on_gpu = MakeState(sites, {}), on_cpu = MakeState(sites, {});
  const auto gpu = MakeTraining(on_gpu.get());
  gpu->Upload();
  gpu->UploadTopology();
  for (TrainingState* state : {on_gpu.get(), on_cpu.get()}) {
    for (size_t i = 40; i < sites.size(); ++i) state->foam.positions[i] *= 1.001f;
  }
  gpu->Upload();
  gpu->RefreshPlanes();
  gpu->Download();
  on_cpu->topology.RefreshPlanes(on_cpu->foam.positions);
  const WalkGeometry<float>&a = on_gpu->topology.geometry(), &b = on_cpu->topology.geometry();
  EXPECT_EQ(Coordinates(a.positions), Coordinates(b.positions));

  // What the GPU itself walks through: rays that meet all those cells.
  const std::vector<BatchRay> rays = RandomRays(*on_cpu, 2000);
  const auto cpu = MakeCpuTrainingDevice(on_cpu.get());
  cpu->Upload();
  cpu->UploadTopology();
  ExpectSameTotals(gpu->Step(StepFor(rays, {})).batch, cpu->Step(StepFor(rays, {})).batch);
}

TEST_P(GpuBasics, FindsStartCells) {
  std::vector<Eigen::Vector3f> sites = RandomSites(500, 36);
  sites.push_back(sites[3]);  // an empty cell, from which no way leads
  const auto state = MakeState(sites, {});
  const auto gpu = MakeTraining(state.get());
  gpu->Upload();
  gpu->UploadTopology();
  std::vector<Eigen::Vector3d> origins;
  std::vector<uint32_t> cells, expected;
  for (int i = 0; i < 200; ++i) {
    CounterRandom random(37, 0x56, i);
    origins.push_back(RandomPoint(&random, 3));
    cells.push_back(i % 3 == 0 ? 500 : i % 3 == 1 ? 0 : 100'000);
    expected.push_back(state->topology.CellAt(origins.back(), 0));
  }
  gpu->StartCells(origins, &cells);
  EXPECT_EQ(cells, expected);
}

TEST_P(GpuBasics, RendersWhatTheCpuRenders) {
  const std::vector<Eigen::Vector3f> sites = RandomSites(400, 38);
  const auto state = MakeState(sites, {});
  const std::vector<BatchRay> rays = RandomRays(*state, 3000);
  const auto cpu = MakeCpuTrainingDevice(state.get());
  const auto gpu = MakeTraining(state.get());
  for (TrainingDevice* device : {cpu.get(), gpu.get()}) {
    device->Upload();
    device->UploadTopology();
  }
  for (int degree = 0; degree <= 2; ++degree) {
    const std::vector<RenderedRay> a = gpu->Render(rays, degree), b = cpu->Render(rays, degree);
    ASSERT_EQ(a.size(), b.size());
    int labelled = 0, differ = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_LE((a[i].color - b[i].color).norm(), 1e-5 * (1 + b[i].color.norm()));
      EXPECT_NEAR(a[i].opacity, b[i].opacity, 1e-5);
      EXPECT_NEAR(a[i].distance, b[i].distance, 1e-4 * (1 + b[i].distance));
      labelled += b[i].class_index >= 0;
      differ += a[i].class_index != b[i].class_index;
      if (a[i].class_index == b[i].class_index) {
        EXPECT_NEAR(a[i].confidence, b[i].confidence, 1e-4);
      }
    }
    EXPECT_GT(labelled, 500);
    EXPECT_LE(differ, 3) << "but for ties";
  }
}

TEST_P(GpuBasics, RendersWhatTheCoresRender) {
  const std::vector<Eigen::Vector3f> sites = RandomSites(400, 39);
  const auto state = MakeState(sites, {});
  const ViewRenderer renderer(state->foam);
  const ClassifierView<float> classifier{state->foam.num_classes,
                                         state->foam.classifier_weight.data(),
                                         state->foam.classifier_bias.data()};
  const auto gpu = MakeGpuCaster(GetParam(), renderer.geometry(), renderer.shading(), classifier);
  const auto cpu = MakeCpuRayCaster(renderer.geometry(), renderer.shading(), classifier);
  std::vector<RayQuery> rays;
  for (const BatchRay& ray : RandomRays(*state, 2000)) {
    rays.push_back({ray.origin, ray.direction, ray.start_cell});
  }
  const std::vector<RenderedRay> a = gpu->Render(rays), b = cpu->Render(rays);
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_LE((a[i].color - b[i].color).norm(), 1e-5 * (1 + b[i].color.norm()));
  }
}

// A cell whose gradient is not finite keeps its parameters, and is counted.
TEST_P(GpuBasics, SkipsGradientsThatAreNotFinite) {
  const std::vector<Eigen::Vector3f> sites = RandomSites(100, 40);
  Scene scene;
  scene.num_classes = 0;
  const auto on_cpu = MakeState(sites, scene), on_gpu = MakeState(sites, scene);
  std::vector<BatchRay> rays = RandomRays(*on_cpu, 200);
  rays[7].target.color[1] = std::numeric_limits<float>::quiet_NaN();
  const auto cpu = MakeCpuTrainingDevice(on_cpu.get());
  const auto gpu = MakeTraining(on_gpu.get());
  for (TrainingDevice* device : {cpu.get(), gpu.get()}) {
    device->Upload();
    device->UploadTopology();
  }
  const int64_t expected = cpu->Step(StepFor(rays, scene)).skipped_updates;
  EXPECT_GT(expected, 0);
  EXPECT_EQ(gpu->Step(StepFor(rays, scene)).skipped_updates, expected);
  gpu->Download();
  for (const float value : on_gpu->foam.sh) ASSERT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace semfoam
