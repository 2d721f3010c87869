// SPDX-License-Identifier: GPL-3.0-or-later
//
// Same input, seed and options: same bytes, whatever the number of threads. Where rays are cast is
// said in the log.
#include <string>
#include <vector>

#include "tests/process_state.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Batches of many blocks, and a foam that grows, with so many sites that they are triangulated
// beside the iterations: all that could depend on the threads takes part.
std::string TrainedFoam(const std::vector<std::string>& arguments, std::string* log = nullptr) {
  const TempFolder folder;
  std::vector<std::string> all = TinyTraining(TrainerOn(kTabletop,
                                                        folder / "out",
                                                        {"--test_every",
                                                         "8",
                                                         "--FoamTraining.num_rays",
                                                         "120000",
                                                         "--FoamTraining.rays_per_iteration",
                                                         "4096",
                                                         "--FoamTraining.initial_sites",
                                                         "1500",
                                                         "--FoamTraining.final_sites",
                                                         "9000",
                                                         // So late that some of these iterations
                                                         // pass while they are triangulated.
                                                         "--FoamTraining.densify_until",
                                                         "0.6",
                                                         "--FoamTraining.sweep_photos",
                                                         "150"}));
  all.insert(all.end(), arguments.begin(), arguments.end());
  const Outcome outcome = RunSemfoam(all);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  if (log != nullptr) *log = outcome.err;
  return ReadFile(folder / "out" / "scene.foam");
}

TEST(Determinism, SameBytesOnAnyNumberOfThreads) {
  std::string log;
  const std::string one = TrainedFoam({"--num_threads", "1"}, &log);
  EXPECT_THAT(log, HasSubstr("triangulations beside the iterations"));
  ASSERT_FALSE(one.empty());
  EXPECT_TRUE(TrainedFoam({"--num_threads", "2"}) == one);
  EXPECT_TRUE(TrainedFoam({"--num_threads", "5"}) == one);
  EXPECT_FALSE(TrainedFoam({"--random_seed", "1"}) == one);
}

TEST(Determinism, WithoutAGpuAutoIsTheCpu) {
  // Hides GPUs from CUDA, if there are any.
  const EnvironmentVariable hidden("CUDA_VISIBLE_DEVICES", "");
  std::string log;
  const std::string on_auto = TrainedFoam({"--num_threads", "2", "--device", "auto"}, &log);
  EXPECT_THAT(log, HasSubstr("Training with ")) << log;
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
  EXPECT_TRUE(TrainedFoam({"--num_threads", "2"}, &log) == on_auto);
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
  EXPECT_TRUE(TrainedFoam({"--num_threads", "2", "--device", "cpu"}, &log) == on_auto);
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
}

// A driver that is there and refuses everything is no GPU.
TEST(Determinism, WithADriverThatFailsAutoIsTheCores) {
  const TempFolder folder;
  const std::string driver = fs::path(SEMFOAM_BROKEN_CUDA_DRIVER).parent_path();
  const EnvironmentVariable libraries("LD_LIBRARY_PATH", driver);
  const EnvironmentVariable note("SEMFOAM_DRIVER_NOTE", (folder / "loaded").string());
  std::string log;
  TrainedFoam({"--num_threads", "2", "--device", "auto"}, &log);
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
  const Outcome refused = RunSemfoam({"foam_evaluator",
                                      "--foam_path",
                                      (folder / "a.foam").string(),
                                      "--image_path",
                                      kTabletop.string(),
                                      "--device",
                                      "cuda:0"});
  EXPECT_EQ(refused.exit_code, 1);
  if (refused.err.find("built without CUDA") == std::string::npos) {
    ExpectRefused(refused, {"", {"device", "cuda:0"}, "there is no GPU here"});
    EXPECT_TRUE(fs::exists(folder / "loaded")) << "the driver was not asked";
  }
}

}  // namespace
}  // namespace semfoam
