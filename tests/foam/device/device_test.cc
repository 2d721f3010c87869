// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/device/device.h"

#include "foam/device/cpu_device.h"
#include "foam/model/sh_degree.h"
#include "foam/train/trainer.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "foam/view/view_renderer.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/foam/synthetic_views.h"
#include "tests/mistake.h"
#include "tests/process_state.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(Device, IsFoundByItsName) {
  for (const std::optional<int> gpus : {std::optional<int>(), std::optional(0), std::optional(3)}) {
    EXPECT_EQ(Device::Find("cpu", gpus).gpu(), std::nullopt);
  }
  EXPECT_EQ(Device::Find("auto", std::nullopt).gpu(), std::nullopt);
  EXPECT_EQ(Device::Find("auto", 0).gpu(), std::nullopt);
  EXPECT_EQ(Device::Find("auto", 3).gpu(), 0);
  EXPECT_EQ(Device::Find("cuda:0", 1).gpu(), 0);
  EXPECT_EQ(Device::Find("cuda:2", 3).gpu(), 2);
  EXPECT_EQ(Device::Find("cuda:2", 3).kind(), DeviceKind::kGpu);
}

// The sentence that refuses `device`, which must name the field.
std::string Refusal(const std::string& device, std::optional<int> gpus) {
  try {
    Device::Find(device, gpus);
  } catch (const FieldError& error) {
    EXPECT_EQ(error.field(), "device");
    return error.what();
  }
  return "";
}

TEST(Device, SaysWhyThereIsNone) {
  EXPECT_THAT(Refusal("cuda:0", std::nullopt),
              NamesMistake("", {"device", "cuda:0", "-DSEMFOAM_CUDA=ON"}, "built without CUDA"));
  EXPECT_THAT(Refusal("cuda:0", 0), NamesMistake("", {"device", "cuda:0"}, "there is no GPU here"));
  EXPECT_THAT(Refusal("cuda:1", 1),
              NamesMistake("", {"device", "cuda:1", "cuda:0"}, "no GPU of that number"));
  EXPECT_THAT(Refusal("cuda:3", 3),
              NamesMistake("", {"device", "cuda:3", "cuda:0 to cuda:2"}, "no GPU of that number"));
  for (const std::string device :
       {"", "gpu", "CPU", "cpu ", "cuda", "cuda:", "cuda:-1", "cuda:-0", "cuda:1x", "cuda: 1"}) {
    for (const std::optional<int> gpus : {std::optional<int>(), std::optional(2)}) {
      EXPECT_THAT(Refusal(device, gpus),
                  NamesMistake("", {"device", "'" + device + "'", "cuda:N"}, "from 0 on"));
    }
  }
}

TEST(Device, TheCpuIsDescribedByItsThreads) {
  const Device cpu = Device::Find("cpu");
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(cpu.Description(), threads == 1 ? "1 thread" : "3 threads");
  }
}

// Of several limits the smallest holds, and each ends with its scope.
TEST(ThreadLimit, EndsWithItsScope) {
  const int all = NumThreads();
  {
    const ThreadLimit three(3);
    EXPECT_EQ(NumThreads(), 3);
    {
      const ThreadLimit one(1);
      EXPECT_EQ(NumThreads(), 1);
    }
    EXPECT_EQ(NumThreads(), 3);
  }
  EXPECT_EQ(NumThreads(), all);
}

// Where no GPU is to be seen, "auto" is the CPU, in every respect.
TEST(Device, AutoIsTheCpuWhereThereIsNoGpu) {
  // Hides GPUs from CUDA, if there are any; read once, at the first look for them.
  const EnvironmentVariable hidden("CUDA_VISIBLE_DEVICES", "");
  const Device device = Device::Find("auto");
  EXPECT_EQ(device.gpu(), std::nullopt);
  EXPECT_EQ(device.kind(), DeviceKind::kCpu);
  const ThreadLimit limit(2);
  EXPECT_EQ(device.Description(), "2 threads");
}

// A small room, trained, as a device has it.
class DeviceCpuTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    TrainingOptions options;
    options.num_rays = 100'000;
    options.rays_per_iteration = 1024;
    options.initial_sites = 500;
    options.final_sites = 1000;
    options.sh_degree = 2;
    options.fixed_sh_degree = true;
    options.densify_events = 3;
    foam_ = new Foam(TrainFoam(Views(), Views().Seeds(500), 3, options, nullptr).foam);
  }
  static void TearDownTestSuite() { delete foam_; }

  static const SyntheticViews& Views() {
    static const SyntheticViews views(8, 32, 24, /*gloss=*/0.5f, /*knows_distances=*/true);
    return views;
  }

  DeviceCpuTest() {
    state_.foam = *foam_;
    state_.optimizer = std::make_unique<FoamOptimizer>(state_.foam);
    state_.densification.Reset(state_.foam.NumSites());
    state_.topology.Triangulate(state_.foam.positions, FreeSpace(Views(), {}), true);
    device_ = MakeCpuTrainingDevice(&state_);
    device_->Upload();
    device_->UploadTopology();
  }

  std::vector<BatchRay> RaysOf(int view) {
    std::vector<uint32_t> start(1, kNoCell);
    device_->StartCells({Views().Origin(view)}, &start);
    std::vector<BatchRay> rays;
    for (const Eigen::Vector3f& direction : Views().Rays(view).directions) {
      BatchRay ray;
      ray.origin = Views().Origin(view).cast<float>();
      ray.direction = direction;
      ray.start_cell = start[0];
      rays.push_back(ray);
    }
    return rays;
  }

  // The device's rays against pixels of the same view.
  static void ExpectSame(const std::vector<RenderedRay>& rendered, const RenderedView& render) {
    ASSERT_EQ(rendered.size(), render.color.size());
    int labelled = 0, opaque = 0;
    for (size_t i = 0; i < rendered.size(); ++i) {
      EXPECT_EQ(rendered[i].color, render.color[i]);
      EXPECT_EQ(rendered[i].opacity, render.opacity[i]);
      EXPECT_EQ(rendered[i].distance, render.distance[i]);
      EXPECT_EQ(ClassIndex{rendered[i].class_index}, render.class_index[i]);
      EXPECT_EQ(rendered[i].confidence, render.confidence[i]);
      labelled += rendered[i].class_index >= 0 && rendered[i].confidence > 0;
      opaque += rendered[i].distance > 0;
    }
    EXPECT_GT(labelled, std::ssize(rendered) / 2);
    EXPECT_GT(opaque, std::ssize(rendered) / 2);
  }

  inline static const Foam* foam_ = nullptr;
  TrainingState state_;
  std::unique_ptr<TrainingDevice> device_;
};

TEST_F(DeviceCpuTest, ShowsWhatTheRendererShows) {
  ExpectSame(device_->Render(RaysOf(1), 2), ViewRenderer(*foam_).Render(Views().Rays(1)));
}

TEST_F(DeviceCpuTest, ShowsTheFoamInALowerShDegree) {
  for (const int degree : {0, 1}) {
    Foam lower = *foam_;
    ChangeShDegree(degree, &lower);
    ExpectSame(device_->Render(RaysOf(2), degree), ViewRenderer(lower).Render(Views().Rays(2)));
  }
  const std::vector<RenderedRay> mean = device_->Render(RaysOf(2), 0),
                                 all = device_->Render(RaysOf(2), 2);
  int differ = 0;
  for (size_t i = 0; i < all.size(); ++i) differ += mean[i].color != all[i].color;
  EXPECT_GT(differ, std::ssize(all) / 2) << "all colours are the same from everywhere";
}

TEST_F(DeviceCpuTest, FindsTheCellsThatOriginsAreInFromAnyCell) {
  const Eigen::Vector3d origins[] = {{0.1, 0.2, 0.3}, {-1, 0.5, 0}, Views().Origin(3)};
  std::vector<Eigen::Vector3d> asked(origins, origins + 3);
  std::vector<uint32_t> cells = {0, 7, kNoCell};
  device_->StartCells(asked, &cells);
  const auto& sites = state_.topology.geometry().positions;
  for (int k = 0; k < 3; ++k) {
    for (const Eigen::Vector3f& site : sites) {
      EXPECT_LE((sites[cells[k]].cast<double>() - origins[k]).norm(),
                (site.cast<double>() - origins[k]).norm());
    }
  }
}

// A step moves the sites; their planes stay until they are told to follow.
TEST_F(DeviceCpuTest, StepsParametersAndLeavesPlanesUntilTheyFollow) {
  std::vector<BatchRay> rays = RaysOf(1);
  for (BatchRay& ray : rays) {
    for (float& c : ray.target.color) c = 0.5f;
    ray.target.class_index = 1;
  }
  LearningRates rates;
  rates.position = 0.1f;
  rates.density = rates.sh_dc = rates.sh_rest = rates.identity = rates.classifier = 0.01f;
  const Foam before = state_.foam;
  const auto planes = state_.topology.geometry().positions;
  const TrainingStepResult result = device_->Step({rays, RayLossWeights{}, 6.9f, 1.0, 1.0, rates});
  EXPECT_GT(result.batch.num_segments, std::ssize(rays));
  EXPECT_GT(result.batch.mean_loss.color, 0);
  EXPECT_GT(result.batch.mean_loss.identity, 0);
  EXPECT_EQ(result.batch.step_limit_hits, 0);
  EXPECT_GT(result.tv_loss, 0);
  EXPECT_EQ(result.skipped_updates, 0);
  EXPECT_NE(state_.foam.positions, before.positions);
  EXPECT_NE(state_.foam.raw_density, before.raw_density);
  EXPECT_NE(state_.foam.sh, before.sh);
  EXPECT_NE(state_.foam.identity, before.identity);
  EXPECT_NE(state_.foam.classifier_weight, before.classifier_weight);
  EXPECT_EQ(state_.topology.geometry().positions, planes);
  device_->RefreshPlanes();
  EXPECT_NE(state_.topology.geometry().positions, planes);
  for (size_t i = 0; i < state_.foam.NumSites(); ++i) {
    ASSERT_EQ(state_.topology.geometry().positions[i], state_.foam.positions[i]);
  }
  // Without a weight the total variation is left alone.
  EXPECT_EQ(device_->Step({rays, RayLossWeights{}, 6.9f, 0, 0, rates}).tv_loss, 0);
}

TEST_F(DeviceCpuTest, PixelsWithoutARayStayEmpty) {
  const ViewRenderer renderer(*foam_);
  CameraRays rays = Views().Rays(1);
  const RenderedView whole = renderer.Render(rays);
  for (const size_t i : {0, 1, 100, 767}) rays.directions[i].setZero();
  const RenderedView holes = renderer.Render(rays);
  for (size_t i = 0; i < rays.directions.size(); ++i) {
    const bool hole = i == 0 || i == 1 || i == 100 || i == 767;
    EXPECT_EQ(holes.color[i], hole ? Eigen::Vector3f::Ones().eval() : whole.color[i]);
    EXPECT_EQ(holes.opacity[i], hole ? 0 : whole.opacity[i]);
    EXPECT_EQ(holes.distance[i], hole ? 0 : whole.distance[i]);
    EXPECT_EQ(holes.class_index[i], hole ? kUnlabelled : whole.class_index[i]);
    EXPECT_EQ(holes.confidence[i], hole ? 0 : whole.confidence[i]);
  }
}

}  // namespace
}  // namespace semfoam
