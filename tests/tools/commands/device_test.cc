// SPDX-License-Identifier: GPL-3.0-or-later
//
// --device: the same training on the CPU and on a GPU, if there is one.
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

struct Quality {
  double psnr, miou;
};

// Trains the table on a device and scores it on the held-out photos, on the same device.
Outcome TrainAndScore(const TempFolder& folder, const std::string& device, Quality* quality) {
  const std::string output = folder / device;
  const Outcome trained = RunSemfoam(TinyTraining({"foam_trainer",
                                                   "--image_path",
                                                   (kTabletop / "images").string(),
                                                   "--input_path",
                                                   (kTabletop / "sparse" / "0").string(),
                                                   "--output_path",
                                                   output,
                                                   "--device",
                                                   device,
                                                   "--test_every",
                                                   "4",
                                                   "--FoamTraining.num_rays",
                                                   "2000000"}));
  if (trained.exit_code != 0) return trained;
  const std::string scores = folder / (device + ".json");
  const Outcome scored = RunSemfoam({"foam_evaluator",
                                     "--foam_path",
                                     output + "/scene.foam",
                                     "--image_path",
                                     (kTabletop / "images").string(),
                                     "--device",
                                     device,
                                     "--json_path",
                                     scores});
  if (scored.exit_code != 0) return scored;
  const auto json = nlohmann::json::parse(ReadFile(scores));
  *quality = {json.at("psnr"), json.at("prompt").at("mIoU")};
  return scored;
}

TEST(Device, TrainsAsWellOnAGpuAsOnTheCpu) {
  const TempFolder folder;
  Quality gpu{}, cpu{};
  const Outcome on_gpu = TrainAndScore(folder, "cuda:0", &gpu);
  if (on_gpu.exit_code != 0) {
    ASSERT_EQ(on_gpu.exit_code, 1);
    ASSERT_THAT(on_gpu.err, AnyOf(HasSubstr("built without CUDA"), HasSubstr("no GPU here")));
    EXPECT_FALSE(std::filesystem::exists(folder / "cuda:0" / "scene.foam"));
    GTEST_SKIP() << on_gpu.err;
  }
  const Outcome on_cpu = TrainAndScore(folder, "cpu", &cpu);
  ASSERT_EQ(on_cpu.exit_code, 0) << on_cpu.err;
  EXPECT_NEAR(gpu.psnr, cpu.psnr, 0.1);
  EXPECT_NEAR(gpu.miou, cpu.miou, 0.02);
}

}  // namespace
}  // namespace semfoam
