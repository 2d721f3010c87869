// SPDX-License-Identifier: GPL-3.0-or-later
//
// Same input, seed and options: same bytes, whatever the number of threads. Where rays are cast is
// said in the log.
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;

// Batches of many blocks, and a foam that grows: all that could depend on the threads takes part.
std::string TrainedFoam(const std::vector<std::string>& arguments, std::string* log = nullptr) {
  const TempFolder folder;
  std::vector<std::string> all = TinyTraining({"foam_trainer",
                                               "--image_path",
                                               (kTabletop / "images").string(),
                                               "--input_path",
                                               (kTabletop / "sparse/0").string(),
                                               "--mask_path",
                                               (kTabletop / "object_mask").string(),
                                               "--output_path",
                                               (folder / "out").string(),
                                               "--test_every",
                                               "8",
                                               "--FoamTraining.num_rays",
                                               "60000",
                                               "--FoamTraining.rays_per_iteration",
                                               "4096",
                                               "--FoamTraining.initial_sites",
                                               "1500"});
  all.insert(all.end(), arguments.begin(), arguments.end());
  const Outcome outcome = RunSemfoam(all);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  if (log != nullptr) *log = outcome.err;
  return ReadFile(folder / "out" / "scene.foam");
}

TEST(Determinism, SameBytesOnAnyNumberOfThreads) {
  const std::string one = TrainedFoam({"--num_threads", "1"});
  ASSERT_FALSE(one.empty());
  EXPECT_TRUE(TrainedFoam({"--num_threads", "2"}) == one);
  EXPECT_TRUE(TrainedFoam({"--num_threads", "5"}) == one);
  EXPECT_FALSE(TrainedFoam({"--random_seed", "1"}) == one);
}

TEST(Determinism, WithoutACardAutoIsTheCores) {
  std::string log;
  const std::string on_auto = TrainedFoam({"--num_threads", "2", "--device", "auto"}, &log);
  if (log.find(", cuda:0 (") != std::string::npos) {
    GTEST_SKIP() << "This machine has a graphics card, and auto is that.";
  }
  EXPECT_THAT(log, HasSubstr("Training with ")) << log;
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
  EXPECT_TRUE(TrainedFoam({"--num_threads", "2"}, &log) == on_auto);
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
  EXPECT_TRUE(TrainedFoam({"--num_threads", "2", "--device", "cpu"}, &log) == on_auto);
  EXPECT_THAT(log, HasSubstr(", 2 threads\n"));
}

}  // namespace
}  // namespace semfoam
