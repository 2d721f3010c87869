// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which objects the commands take, and that nothing is trained for an export that cannot be.
#include "foam/model/model.h"

#include "tests/export/test_foams.h"
#include "tests/tools/exports.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

class ExportChoice : public testing::Test {
 protected:
  // Trains for a moment: the wall and the mug become objects, nothing else does.
  Outcome Segment(std::vector<std::string> options) {
    options.insert(options.begin(),
                   {"automatic_segmenter",
                    "--workspace_path",
                    kTabletop.string(),
                    "--output_path",
                    Out().string(),
                    "--quality",
                    "low",
                    "--FoamTraining.num_rays",
                    "20000",
                    "--FoamTraining.final_sites",
                    "2000",
                    "--FoamTraining.max_image_size",
                    "80"});
    return RunSemfoam(options);
  }

  Outcome Export(const std::string& command, const std::vector<std::string>& options) {
    return RunExporter(command, folder_ / "scene.foam", Out(), options);
  }

  fs::path Out() const { return folder_ / "out"; }

  TempFolder folder_;
};

TEST_F(ExportChoice, WhatCannotBeExportedIsRefusedBeforeAPhotoIsRead) {
  const struct {
    std::vector<std::string> options;
    const char* says;
  } cases[] = {
      {{"--labels", "mug,mgu"}, "The labels name 'mgu', which is no id and no name in "},
      {{"--VolumeExport.labels", "mgu"}, "labels.json; there are 1 (floor), 2 (wall), "},
      {{"--exclude_labels", "mgu"}, "The excluded labels name 'mgu', which is no id and no name"},
      {{"--level", "mug,mgu"}, "--level: the labels name 'mgu', which is no id and no name in "},
      {{"--VolumeExport.voxel_size", "1e-9"},
       "voxel_size 1e-09 is too small: the model's points are "},
      {{"--VolumeExport.max_voxels", "2"}, "max_resolution 256 is too large: "},
      {{"--labels", "mug", "--Effects.semantics", "off"}, "without masks there will be none"},
  };
  for (const auto& [options, says] : cases) {
    const Outcome outcome = Segment(options);
    EXPECT_EQ(outcome.exit_code, 1) << says;
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr(says));
    EXPECT_THAT(outcome.err, Not(HasSubstr("Loading"))) << says;
    EXPECT_THAT(FilesBelow(Out()), IsEmpty()) << says;
  }
  // Folders in the way of files.
  fs::create_directories(Out() / "scene.vdb");
  const Outcome folder = Segment({});
  EXPECT_EQ(folder.exit_code, 1);
  EXPECT_THAT(folder.err, HasSubstr("scene.vdb: is a folder, in the way of the file of that name"));
  EXPECT_THAT(folder.err, Not(HasSubstr("Loading")));
  fs::remove_all(Out());
  WriteFile(folder_ / "objects", "");
  fs::create_directories(Out());
  fs::rename(folder_ / "objects", Out() / "objects");
  EXPECT_THAT(Segment({}).err, HasSubstr("objects: is a file, in the way of the folder"));
}

TEST_F(ExportChoice, AnIdThatNoMaskHasIsRefusedBeforeTheTraining) {
  for (const char* option : {"--labels", "--exclude_labels"}) {
    const Outcome outcome = Segment({option, "77"});
    EXPECT_EQ(outcome.exit_code, 1);
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0],
                HasSubstr("labels name '77', which is no label; there are 1 "));
    EXPECT_THAT(outcome.err, Not(HasSubstr("Training with")));
    EXPECT_THAT(FilesBelow(Out()), IsEmpty());
  }
}

TEST_F(ExportChoice, TheChosenObjectsAloneAreWritten) {
  const Outcome outcome =
      Segment({"--VolumeExport.labels", "mug,ball", "--formats", "vdb,ply,glb"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("WARNING: No files for ball (9), which "));
  EXPECT_THAT(outcome.err, HasSubstr("1 object, everything is in"));
  EXPECT_THAT(FilesBelow(Out() / "objects"),
              UnorderedElementsAre("6_mug.vdb", "6_mug.ply", "6_mug.glb"));
}

TEST_F(ExportChoice, EveryExporterTakesTheSameOptions) {
  WriteModel(folder_ / "scene.foam", TouchingBalls(1500));
  const auto files = [&](const std::string& command, const std::vector<std::string>& options) {
    const Outcome outcome = Export(command, options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::vector<std::string> below = FilesBelow(Out() / "objects");
    fs::remove_all(Out());
    return below;
  };
  const auto meshes = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"--formats", "ply"});
    return files("mesh_exporter", options);
  };
  const auto volumes = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"--max_resolution", "16"});
    return files("volume_exporter", options);
  };
  EXPECT_THAT(meshes({"--labels", "mug"}), UnorderedElementsAre("7_mug.ply"));
  EXPECT_THAT(meshes({"--exclude_labels", "7"}), UnorderedElementsAre("8_label_8.ply"));
  EXPECT_THAT(volumes({"--labels", "id:7"}), UnorderedElementsAre("7_mug.vdb"));
  EXPECT_THAT(volumes({"--VolumeExport.labels", "mug"}), UnorderedElementsAre("7_mug.vdb"));
  EXPECT_THAT(volumes({"--exclude_labels", "mug"}), UnorderedElementsAre("8_label_8.vdb"));
  for (const char* command : {"mesh_exporter", "volume_exporter"}) {
    for (const char* option : {"--labels", "--exclude_labels"}) {
      const Outcome outcome = Export(command, {option, "teapot"});
      EXPECT_EQ(outcome.exit_code, 1);
      ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
      EXPECT_THAT(outcome.Errors()[0],
                  HasSubstr("name 'teapot', which is no object; the scene has 7 (mug), 8 "));
      EXPECT_THAT(FilesBelow(Out()), IsEmpty());
    }
  }
  // One stage and one scene of what is chosen.
  ASSERT_EQ(Export("mesh_exporter", {"--labels", "mug"}).exit_code, 0);
  EXPECT_THAT(ReadFile(Out() / "scene.usda"), Not(HasSubstr("label_8")));
  const auto labels = nlohmann::json::parse(ReadFile(Out() / "labels.json"));
  ASSERT_EQ(labels["objects"].size(), 2u) << "the foam still has both";
  EXPECT_EQ(labels["objects"][1]["files"], nlohmann::json::object());
}

TEST_F(ExportChoice, ATiltedModelIsWarnedAbout) {
  Model model = TouchingBalls(400);
  model.photos.resize(1);
  PhotoRecord& photo = model.photos[0];
  photo.name = "a.jpg";
  photo.camera_model = "SIMPLE_PINHOLE";
  photo.width = photo.height = 10;
  photo.camera_params = {10, 5, 5};
  const auto said = [&](double degrees, const std::string& axis) {
    photo.cam_from_world_rotation =
        Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitX());
    WriteModel(folder_ / "scene.foam", model);
    const Outcome outcome =
        Export("mesh_exporter", {"--formats", "ply", "--labels", "mug", "--up_axis", axis});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    if (axis != "colmap") {
      const auto labels = nlohmann::json::parse(ReadFile(Out() / "labels.json"));
      EXPECT_NEAR(labels["frame"]["up_tilt_degrees"], degrees, 0.01);
    }
    fs::remove_all(Out());
    return outcome.err;
  };
  const std::string level = "leaves the photos' mean upward direction 3.2 degrees off that axis";
  EXPECT_THAT(said(3.2, "z"), HasSubstr(level));
  EXPECT_THAT(said(3.2, "z"), Not(HasSubstr("WARNING")));
  const std::string tilted = said(29.5, "y");
  EXPECT_THAT(tilted, HasSubstr("up_axis y leaves the photos' mean upward direction 29.5"));
  EXPECT_THAT(tilted, HasSubstr("colmap model_orientation_aligner"));
  EXPECT_THAT(tilted, HasSubstr("the rotation with transform"));
  EXPECT_THAT(said(29.5, "colmap"), Not(HasSubstr("upward")));
}

}  // namespace
}  // namespace semfoam
