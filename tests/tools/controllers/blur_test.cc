// SPDX-License-Identifier: GPL-3.0-or-later
//
// A photo that is blurred counts less in the training.
#include "tools/controllers/training_run.h"

#include <filesystem>
#include <string>
#include <vector>

#include "tests/plugin/photo/changed_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class BlurTest : public testing::Test {
 protected:
  BlurTest() {
    WriteChangedWorkspace(
        fs::path(SEMFOAM_TEST_DATA) / "tabletop", folder_ / "w", {.shaken = {30}});
  }

  // Trains and returns scene.foam.
  std::string Train(const std::string& name, bool blur) {
    TrainingRun run;
    run.training.num_rays = 20'000;
    run.training.final_sites = 2'000;
    run.sweep_photos = 0;
    run.scene.test_every = 8;
    run.effects.semantics = false;
    run.effects.blur = blur;
    CompleteFromWorkspace(folder_ / "w", &run);
    CompleteTrainingRun(&run);
    TrainingFolder folder(folder_ / name, {}, "");
    TrainAndWrite(&folder, &run);
    return ReadFile(folder_ / name / "scene.foam");
  }

  json BlurEffect(const std::string& name) const {
    const json effects = json::parse(ReadFile(folder_ / name / "effects.json"));
    for (const json& effect : effects["effects"]) {
      if (effect["effect"] == "blur") return effect;
    }
    return {};
  }

  const TempFolder folder_;
};

TEST_F(BlurTest, ItsPixelsAreDrawnLess) {
  const std::string by_probe = Train("auto", true), all_alike = Train("off", false);
  EXPECT_FALSE(by_probe == all_alike);
  EXPECT_TRUE(Train("again", true) == by_probe);
  EXPECT_EQ(BlurEffect("auto")["on"], true);
  EXPECT_EQ(BlurEffect("auto")["measures"]["photos"], 1);
  EXPECT_EQ(BlurEffect("off")["on"], false);
}

}  // namespace
}  // namespace semfoam
