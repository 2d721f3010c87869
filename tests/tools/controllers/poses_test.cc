// SPDX-License-Identifier: GPL-3.0-or-later
//
// Photos with disturbed camera poses: these are refined before and during the training.
#include "plugin/colmap/colmap_model.h"
#include "tools/controllers/training_run.h"

#include <filesystem>
#include <stdexcept>

#include "tests/plugin/photometric/disturbed_poses.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class PosesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    for (const bool tracks : {false, true}) {
      const fs::path workspace = *folder_ / (tracks ? "tracks" : "no_tracks");
      WriteDisturbedModel(Tabletop() / "sparse/0", workspace / "sparse/0", 8, tracks);
      fs::create_directory_symlink(Tabletop() / "images", workspace / "images");
    }
  }
  static void TearDownTestSuite() { delete folder_; }
  static fs::path Tabletop() { return fs::path(SEMFOAM_TEST_DATA) / "tabletop"; }

  struct Result {
    std::string foam;
    json effect;
  };

  // Trains into *folder_ / name.
  static Result Train(const fs::path& workspace,
                      const std::string& name,
                      EffectSwitch poses,
                      CheckpointOptions checkpoints = {},
                      bool stop = false) {
    TrainingRun run;
    run.training.num_rays = 400'000;
    run.training.rays_per_iteration = 2048;
    run.training.final_sites = 6'000;
    run.sweep_photos = 0;
    run.scene.test_every = 8;
    run.effects.semantics = false;
    run.effects.transients = false;
    run.effects.poses = poses;
    CompleteFromWorkspace(workspace, &run);
    CompleteTrainingRun(&run);
    Result result;
    run.when_written = [&](const auto&, const auto&) {
      // After the last checkpoint, before the result counts as finished.
      if (stop) throw std::runtime_error("stopped");
    };
    TrainingFolder folder(*folder_ / name, checkpoints, "");
    TrainAndWrite(&folder, &run);
    result.foam = ReadFile(*folder_ / name / "scene.foam");
    const json effects = json::parse(ReadFile(*folder_ / name / "effects.json"));
    for (const json& effect : effects["effects"]) {
      if (effect["effect"] == "poses") result.effect = effect;
    }
    return result;
  }

  static inline TempFolder* folder_ = nullptr;
};

TEST_F(PosesTest, AreRefinedByTracks) {
  const Result with = Train(*folder_ / "tracks", "auto", EffectSwitch::kAuto);
  EXPECT_EQ(with.effect["on"], true);
  EXPECT_EQ(with.effect["decided_by"], "probe");
  EXPECT_GT(with.effect["measures"]["track_gain"], 0.4);
  const Result without = Train(*folder_ / "tracks", "off", EffectSwitch::kOff);
  EXPECT_EQ(without.effect["on"], false);
  EXPECT_EQ(without.effect["decided_by"], "option");
  EXPECT_FALSE(fs::exists(*folder_ / "off/sparse"));

  // The model has the poses of the foam, and all else of the file.
  const Reconstruction given = ReadReconstruction(*folder_ / "tracks/sparse/0");
  const Reconstruction refined = ReadReconstruction(*folder_ / "auto/sparse/0");
  ASSERT_EQ(refined.images.size(), given.images.size());
  const Reconstruction truth = ReadReconstruction(Tabletop() / "sparse/0");
  int num_moved = 0;
  double given_error = 0, refined_error = 0;
  for (size_t i = 0; i < given.images.size(); ++i) {
    EXPECT_EQ(refined.images[i].name, given.images[i].name);
    EXPECT_EQ(refined.images[i].points.size(), given.images[i].points.size());
    num_moved +=
        refined.images[i].cam_from_world.translation != given.images[i].cam_from_world.translation;
    const Pose& pose = truth.images[i].cam_from_world;
    given_error +=
        given.images[i].cam_from_world.UnitRotation().angularDistance(pose.UnitRotation());
    refined_error +=
        refined.images[i].cam_from_world.UnitRotation().angularDistance(pose.UnitRotation());
  }
  EXPECT_EQ(num_moved, 56);
  EXPECT_LT(refined_error, 0.4 * given_error);
  EXPECT_TRUE(ReadFile(*folder_ / "auto/sparse/0/points3D.bin") ==
              ReadFile(*folder_ / "tracks/sparse/0/points3D.bin"));

  // A run without refined poses in the same folder takes the model away, but not one of others.
  fs::create_directories(*folder_ / "off/sparse/0");
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    fs::copy_file(Tabletop() / "sparse/0" / name, *folder_ / "off/sparse/0" / name);
  }
  const std::string others = ReadFile(*folder_ / "off/sparse/0/images.bin");
  Train(*folder_ / "tracks", "off", EffectSwitch::kAuto, {.overwrite = true});
  EXPECT_TRUE(ReadFile(*folder_ / "off/sparse/0/images.bin") == others);
  Train(*folder_ / "tracks", "auto", EffectSwitch::kOff, {.overwrite = true});
  EXPECT_FALSE(fs::exists(*folder_ / "auto/sparse/0/images.bin"));
}

TEST_F(PosesTest, AreRefinedByPixelsWithTheSameBytesAfterAStop) {
  const fs::path workspace = *folder_ / "no_tracks";
  EXPECT_THROW(Train(workspace, "stopped", EffectSwitch::kOn, {.every = 0.01}, true),
               std::runtime_error);
  const std::string whole = ReadFile(*folder_ / "stopped/scene.foam");
  const std::string effects = ReadFile(*folder_ / "stopped/effects.json");
  const std::string images = ReadFile(*folder_ / "stopped/sparse/0/images.bin");
  for (const char* file : {"scene.foam", "effects.json"}) fs::remove(*folder_ / "stopped" / file);
  const Result resumed =
      Train(workspace, "stopped", EffectSwitch::kOn, {.every = 0.01, .resume = true});
  EXPECT_TRUE(resumed.foam == whole);
  EXPECT_EQ(ReadFile(*folder_ / "stopped/effects.json"), effects);
  EXPECT_TRUE(ReadFile(*folder_ / "stopped/sparse/0/images.bin") == images);
  EXPECT_EQ(resumed.effect["decided_by"], "option");
  EXPECT_TRUE(resumed.effect["measures"].contains("pixel_gain"));
  EXPECT_GT(resumed.effect["measures"]["largest_degrees"], 0);
}

}  // namespace
}  // namespace semfoam
