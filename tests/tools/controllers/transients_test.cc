// SPDX-License-Identifier: GPL-3.0-or-later
//
// Photos of a scene in which something passes by: it is left out of the training.
#include "tools/controllers/training_run.h"

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/plugin/photo/changed_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class TransientsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    WriteChangedWorkspace(fs::path(SEMFOAM_TEST_DATA) / "tabletop",
                          *folder_ / "w",
                          {.passed_by = {3, 13, 22, 31, 42, 51}, .seed = 3});
  }
  static void TearDownTestSuite() { delete folder_; }

  struct Result {
    std::string foam;
    json effect;
    double held_out_psnr = 0;
  };

  // Trains and returns the result.
  static Result Train(const std::string& name,
                      bool transients,
                      bool resume = false,
                      bool stop = false,
                      uint64_t seed = 0) {
    TrainingRun run;
    run.training.random_seed = seed;
    run.training.num_rays = 3'000'000;
    run.training.rays_per_iteration = 4096;
    run.training.final_sites = 20'000;
    run.scene.test_every = 8;
    run.effects.semantics = false;
    run.effects.transients = transients;
    CompleteFromWorkspace(*folder_ / "w", &run);
    CompleteTrainingRun(&run);
    Result result;
    run.when_written = [&](const std::vector<TrainingProgress>& log, const auto&) {
      result.held_out_psnr = log.back().held_out_psnr;
      // After the last checkpoint, before the result counts as finished.
      if (stop) throw std::runtime_error("stopped");
    };
    TrainingFolder folder(*folder_ / name, {.every = 0.01, .resume = resume}, "");
    TrainAndWrite(&folder, &run);
    result.foam = ReadFile(*folder_ / name / "scene.foam");
    const json effects = json::parse(ReadFile(*folder_ / name / "effects.json"));
    for (const json& effect : effects["effects"]) {
      if (effect["effect"] == "transients") result.effect = effect;
    }
    return result;
  }

  static inline TempFolder* folder_ = nullptr;
};

// One pair of runs as short as these gains 0.5 dB with a deviation of 0.2 dB, so several decide.
TEST_F(TransientsTest, AreLeftOut) {
  constexpr int kSeeds = 3;
  double gain = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const std::string number = std::to_string(seed);
    const Result with = Train("auto" + number, true, false, false, seed);
    const Result without = Train("off" + number, false, false, false, seed);
    EXPECT_EQ(with.effect["on"], true);
    EXPECT_EQ(with.effect["decided_by"], "probe");
    // Of so short a training, a foam is taken in by a photo or two more.
    EXPECT_GE(with.effect["measures"]["photos"], 6);
    EXPECT_LE(with.effect["measures"]["photos"], 8);
    EXPECT_GT(with.effect["measures"]["share"], 0.1);
    EXPECT_EQ(without.effect["on"], false);
    EXPECT_EQ(without.effect["decided_by"], "option");
    gain += (with.held_out_psnr - without.held_out_psnr) / kSeeds;
  }
  EXPECT_GT(gain, 0.3);
}

TEST_F(TransientsTest, GiveTheSameBytesAfterAStop) {
  EXPECT_THROW(Train("stopped", true, false, true), std::runtime_error);
  const std::string whole = ReadFile(*folder_ / "stopped/scene.foam");
  const std::string effects = ReadFile(*folder_ / "stopped/effects.json");
  for (const char* file : {"scene.foam", "effects.json"}) fs::remove(*folder_ / "stopped" / file);
  const Result resumed = Train("stopped", true, true);
  EXPECT_TRUE(resumed.foam == whole);
  EXPECT_EQ(ReadFile(*folder_ / "stopped/effects.json"), effects);
}

}  // namespace
}  // namespace semfoam
