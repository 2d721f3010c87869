// SPDX-License-Identifier: GPL-3.0-or-later
//
// Photos of a scene in which a lamp moves: their light is fitted to the foam in training.
#include "tools/controllers/training_run.h"

#include <filesystem>
#include <stdexcept>

#include "tests/plugin/photo/changed_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class ShadingTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    WriteChangedWorkspace(fs::path(SEMFOAM_TEST_DATA) / "tabletop",
                          *folder_ / "w",
                          {.exposure = 0.1, .shading = 0.4, .seed = 3});
  }
  static void TearDownTestSuite() { delete folder_; }

  static TrainingRun RunOf(EffectSwitch shading) {
    TrainingRun run;
    run.training.num_rays = 1'000'000;
    run.training.rays_per_iteration = 4096;
    run.training.final_sites = 12'000;
    run.sweep_photos = 0;
    run.scene.test_every = 8;
    run.effects.semantics = false;
    run.effects.shading = shading;
    CompleteFromWorkspace(*folder_ / "w", &run);
    CompleteTrainingRun(&run);
    return run;
  }

  static Model Train(const std::string& name, TrainingRun run, bool resume = false) {
    TrainingFolder folder(*folder_ / name, {.every = 0.01, .resume = resume}, "");
    return TrainAndWrite(&folder, &run);
  }

  static json ShadingOf(const json& effects) {
    for (const json& effect : effects["effects"]) {
      if (effect["effect"] == "shading") return effect;
    }
    return {};
  }

  static json EffectsOf(const std::string& name) {
    return json::parse(ReadFile(*folder_ / name / "effects.json"));
  }

  static TempFolder* folder_;
};

TempFolder* ShadingTest::folder_ = nullptr;

TEST_F(ShadingTest, IsFittedWhereALampMoves) {
  const Model model = Train("auto", RunOf(EffectSwitch::kAuto));
  EXPECT_EQ(model.options.at("shading"), "1");
  const json effects = EffectsOf("auto");
  const json shading = ShadingOf(effects);
  EXPECT_EQ(shading["on"], true);
  EXPECT_EQ(shading["decided_by"], "probe");
  EXPECT_GE(shading["measures"]["degree"], 1);
  EXPECT_GT(shading["measures"]["shading"], 0.05);
  ASSERT_EQ(effects["photos"].size(), 64u);
  // The slopes that were put in, over half the diagonal; known up to their mean over the photos.
  Eigen::Vector2d sums = Eigen::Vector2d::Zero(), squares = Eigen::Vector2d::Zero();
  int number = -1;
  for (const json& photo : effects["photos"]) {
    ++number;
    if (photo["held_out"]) continue;
    const Eigen::Vector2d slopes =
        DrawSlopes({.exposure = 0.1, .shading = 0.4, .seed = 3}, number) * 0.625;
    const Eigen::Vector2d found(photo["shading"][1][0], photo["shading"][1][1]);
    sums += found - slopes;
    squares += (found - slopes).cwiseAbs2();
  }
  const Eigen::Vector2d variance = squares / 56 - (sums / 56).cwiseAbs2();
  EXPECT_LT(std::sqrt(variance.maxCoeff()), 0.16);  // put in: 0.25
}

TEST_F(ShadingTest, StaysOffByOption) {
  TrainingRun run = RunOf(EffectSwitch::kOff);
  run.training.num_rays = 50'000;
  const Model model = Train("off", run);
  EXPECT_FALSE(model.options.contains("shading"));
  const json effects = EffectsOf("off");
  EXPECT_EQ(ShadingOf(effects)["on"], false);
  EXPECT_EQ(ShadingOf(effects)["decided_by"], "option");
}

TEST_F(ShadingTest, HasTheSameBytesAfterAStop) {
  TrainingRun stopped = RunOf(EffectSwitch::kAuto);
  // After the last checkpoint, before the result counts as finished.
  stopped.when_written = [](const auto&, const auto&) { throw std::runtime_error("stopped"); };
  EXPECT_THROW(Train("stopped", stopped), std::runtime_error);
  const std::string whole = ReadFile(*folder_ / "stopped/scene.foam");
  const json effects = EffectsOf("stopped");
  for (const char* file : {"scene.foam", "effects.json"}) fs::remove(*folder_ / "stopped" / file);
  Train("stopped", RunOf(EffectSwitch::kAuto), /*resume=*/true);
  EXPECT_TRUE(ReadFile(*folder_ / "stopped/scene.foam") == whole);
  EXPECT_EQ(EffectsOf("stopped"), effects);
}

}  // namespace
}  // namespace semfoam
