// SPDX-License-Identifier: GPL-3.0-or-later
//
// Workspaces from which a training would learn less than their owner thinks, as the commands that
// train, and scene_analyzer, tell of them.
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

std::vector<std::string> Warnings(const Outcome& outcome) {
  std::vector<std::string> warnings;
  std::istringstream lines(outcome.err);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("WARNING: ")) warnings.push_back(line.substr(9));
  }
  return warnings;
}

// The commands that look at a workspace before or for a training, as shortly as they can.
Outcome RunOn(const std::string& command,
              const fs::path& workspace,
              const fs::path& output,
              const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {command, "--output_path", output.string()};
  if (command == "automatic_segmenter") {
    arguments.insert(arguments.end(), {"--workspace_path", workspace.string(), "--formats", "ply"});
  } else {
    arguments.insert(arguments.end(),
                     {"--image_path",
                      (workspace / "images").string(),
                      "--input_path",
                      (workspace / "sparse").string()});
  }
  arguments.insert(arguments.end(),
                   {"--FoamTraining.max_image_size",
                    "80",
                    "--FoamTraining.num_rays",
                    "20000",
                    "--FoamTraining.rays_per_iteration",
                    "512",
                    "--FoamTraining.final_sites",
                    "1000"});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunSemfoam(arguments);
}

TEST(SceneWarnings, AreNoneForAGoodScene) {
  const TempFolder folder;
  const Outcome outcome = RunOn("scene_analyzer", kTabletop, folder / "out");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(Warnings(outcome), IsEmpty());
}

TEST(SceneWarnings, TellOfMasksThatAreNotFound) {
  const TempFolder folder;
  const fs::path workspace = folder / "workspace";
  CopyTabletop(workspace);
  fs::rename(workspace / "object_mask", workspace / "masks");
  for (const char* command : {"automatic_segmenter", "foam_trainer", "scene_analyzer"}) {
    const Outcome outcome = RunOn(command, workspace, folder / command);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(Warnings(outcome),
                testing::Contains(StartsWith((workspace / "masks").string() +
                                             " holds 64 .png files and is not looked at")))
        << command << outcome.err;
    const Outcome given = RunOn(
        command, workspace, folder / "given", {"--mask_path", (workspace / "images").string()});
    ExpectRefused(given, {(workspace / "images").string(), {"64 .jpg files"}, "holds no mask"});
    EXPECT_FALSE(fs::exists(folder / "given/scene.foam"));
  }
  fs::remove_all(workspace / "masks");
  const Outcome none = RunOn("foam_trainer", workspace, folder / "none");
  EXPECT_THAT(none.err, HasSubstr("Without labels"));
  EXPECT_THAT(none.err, Not(HasSubstr("looked at")));
}

TEST(SceneWarnings, TellOfModelsThatShowPartOfThePhotosOrFitNone) {
  const TempFolder folder;
  const fs::path workspace = folder / "workspace";
  CopyTabletop(workspace);
  Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  WriteReconstruction(workspace / "sparse/1", model, ModelFormat::kBinary);
  // The second half of the photos goes, and the others are turned by 3 degrees each.
  std::sort(model.images.begin(), model.images.end(), [](const Image& a, const Image& b) {
    return a.name < b.name;
  });
  model.images.resize(32);
  for (Point3D& point : model.points) {
    std::erase_if(point.track, [&](const TrackElement& element) {
      return std::none_of(model.images.begin(), model.images.end(), [&](const Image& image) {
        return image.id == element.image_id;
      });
    });
  }
  for (size_t i = 0; i < model.images.size(); ++i) {
    Pose& pose = model.images[i].cam_from_world;
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(i % 2 == 0 ? 0.05 : -0.05, Eigen::Vector3d::UnitX()));
    pose.rotation = (turn * pose.rotation).normalized();
    pose.translation = turn * pose.translation;
  }
  WriteReconstruction(workspace / "sparse/0", model, ModelFormat::kBinary);
  const std::string path = (workspace / "sparse/0").string();
  for (const char* command : {"automatic_segmenter", "foam_trainer", "scene_analyzer"}) {
    const Outcome outcome = RunOn(command, workspace, folder / command);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::vector<std::string> warnings = Warnings(outcome);
    EXPECT_THAT(warnings,
                testing::Contains(AllOf(StartsWith(path + ": of several models"),
                                        HasSubstr("beside it is 1 (64 photos)"),
                                        HasSubstr("would take one with more photos"))))
        << command;
    EXPECT_THAT(warnings,
                testing::Contains(HasSubstr("images: 32 of its 64 photos are not in the model")));
    EXPECT_THAT(warnings,
                testing::Contains(StartsWith(path + ": its poses do not fit its points")));
  }
}

TEST(SceneWarnings, SayHowToKnowTheQualityOnNewViews) {
  const TempFolder folder;
  const std::string sentence = "No photo is held out, so the quality on new views is not known";
  EXPECT_THAT(RunOn("foam_trainer", kTabletop, folder / "all").err, HasSubstr(sentence));
  const Outcome held_out = RunOn("foam_trainer", kTabletop, folder / "some", {"--test_every", "8"});
  EXPECT_THAT(held_out.err, Not(HasSubstr(sentence)));
  EXPECT_THAT(held_out.err, HasSubstr("held-out PSNR"));
}

TEST(SceneWarnings, TellOfLabelsThatAreSmallerThanCells) {
  const TempFolder folder;
  fs::create_directory(folder / "masks");
  fs::copy_file(kTabletop / "object_mask/0004.png", folder / "masks/0004.png");
  // 1000 cells for a room and all that is on its table.
  const Outcome outcome = RunOn(
      "foam_trainer", kTabletop, folder / "out", {"--mask_path", (folder / "masks").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("1 of 64 photos have a mask, 13 labels"));
  EXPECT_THAT(outcome.err, HasSubstr("Few photos have masks: their labels were spread"));
  EXPECT_THAT(Warnings(outcome),
              testing::Contains(AllOf(StartsWith("The cells are too large for the masks: "),
                                      HasSubstr(" fewer than 4 cells; more sites (final_sites)"))));
}

}  // namespace
}  // namespace semfoam
