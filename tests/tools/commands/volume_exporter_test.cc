// SPDX-License-Identifier: GPL-3.0-or-later
//
// The command volume_exporter on a small foam: that each option reaches the files. What the files
// hold is tested with the library.
#include "foam/model/model.h"

#include <set>

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
using ::testing::SizeIs;

class VolumeExporter : public testing::Test {
 protected:
  VolumeExporter() { WriteModel(foam_, TouchingBalls(800)); }

  Outcome Run(const std::string& out, const std::vector<std::string>& options) const {
    return RunExporter("volume_exporter", foam_, folder_ / out, options);
  }

  std::vector<std::string> Files(const std::string& out) const { return FilesBelow(folder_ / out); }

  // What vdb_print says of a file, with the option.
  std::string Print(const std::string& option, const std::string& file) const {
    const Outcome outcome = RunProgram("vdb_print", {option, (folder_ / file).string()});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }

  const TempFolder folder_;
  const fs::path foam_ = folder_ / "scene.foam";
};

TEST_F(VolumeExporter, ShortAndLongSpellingsAreTheSame) {
  const std::pair<std::string, std::string> values[] = {{"voxel_size", "0.05"},
                                                        {"max_resolution", "32"},
                                                        {"labels", "mug"},
                                                        {"crop", "-1,-1,-1,0,1,1"},
                                                        {"supersample", "2"}};
  ASSERT_EQ(Run("default", {"--max_resolution", "40"}).exit_code, 0);
  for (const auto& [name, value] : values) {
    std::vector<std::string> rest;
    if (name != "voxel_size" && name != "max_resolution") rest = {"--max_resolution", "40"};
    std::vector<std::string> short_one = rest, long_one = rest;
    short_one.insert(short_one.end(), {"--" + name, value});
    long_one.insert(long_one.end(), {"--VolumeExport." + name, value});
    EXPECT_EQ(Run(name, short_one).exit_code, 0) << name;
    EXPECT_EQ(Run("long " + name, long_one).exit_code, 0) << name;
    WriteFile(folder_ / "project.ini", name + " = " + value + "\n");
    std::vector<std::string> from_file = rest;
    from_file.insert(from_file.end(), {"--project_path", (folder_ / "project.ini").string()});
    EXPECT_EQ(Run("file " + name, from_file).exit_code, 0) << name;
    const std::string scene = ReadFile(folder_ / name / "scene.vdb");
    EXPECT_TRUE(scene == ReadFile(folder_ / ("long " + name) / "scene.vdb")) << name;
    EXPECT_TRUE(scene == ReadFile(folder_ / ("file " + name) / "scene.vdb")) << name;
    EXPECT_FALSE(scene == ReadFile(folder_ / "default" / "scene.vdb")) << name;
  }
  EXPECT_THAT(Files("labels"),
              testing::UnorderedElementsAre("scene.vdb", "labels.json", "objects/7_mug.vdb"));

  const Outcome both = Run("both", {"--voxel_size", "0.1", "--VolumeExport.voxel_size", "0.2"});
  EXPECT_EQ(both.exit_code, 1);
  ASSERT_THAT(both.Errors(), SizeIs(1));
  EXPECT_THAT(both.Errors()[0], HasSubstr("'--VolumeExport.voxel_size' is given more than once"));
  EXPECT_THAT(RunSemfoam({"automatic_segmenter", "-h"}).out, HasSubstr("--VolumeExport.labels"));
}

TEST_F(VolumeExporter, WritesWhatIsAskedFor) {
  const Outcome outcome = Run("out",
                              {"--max_resolution",
                               "40",
                               "--VolumeExport.nvdb",
                               "1",
                               "--VolumeExport.points",
                               "1",
                               "--VolumeExport.label_grid_type",
                               "both",
                               "--VolumeExport.color_grid_name",
                               "Cd",
                               "--VolumeExport.density_grid_name",
                               "smoke",
                               "--VolumeExport.label_grid_name",
                               "id",
                               "--VolumeExport.confidence_grid_name",
                               "sure",
                               "--VolumeExport.surface_grid_name",
                               "sdf"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, testing::Not(HasSubstr("WARNING")));
  std::set<std::string> expected = {"labels.json", "scene_points.vdb"};
  for (const char* stem : {"scene", "scene_labels_int32", "objects/7_mug", "objects/8_label_8"}) {
    expected.insert({std::string(stem) + ".vdb", std::string(stem) + ".nvdb"});
  }
  const std::vector<std::string> files = Files("out");
  EXPECT_EQ(std::set<std::string>(files.begin(), files.end()), expected);
  const auto labels = nlohmann::json::parse(ReadFile(folder_ / "out/labels.json"));
  EXPECT_EQ(labels["objects"][0]["files"]["vdb"], "objects/7_mug.vdb");
  EXPECT_EQ(labels["objects"][0]["files"]["nvdb"], "objects/7_mug.nvdb");
  const std::string grids = Print("-l", "out/objects/7_mug.vdb");
  for (const char* name : {"Cd", "smoke", "id", "sure", "sdf"}) {
    EXPECT_THAT(grids, HasSubstr(name));
  }
  EXPECT_THAT(Print("-l", "out/scene_labels_int32.vdb"), HasSubstr("int32"));
  EXPECT_THAT(Print("-l", "out/scene_points.vdb"), HasSubstr("points"));
}

TEST_F(VolumeExporter, TheMetadataNameTheModel) {
  ASSERT_EQ(Run("out", {"--max_resolution", "40"}).exit_code, 0);
  for (const char* file : {"out/scene.vdb", "out/objects/8_label_8.vdb"}) {
    const std::string metadata = Print("-m", file);
    EXPECT_THAT(metadata, HasSubstr("source_model_xxh64: " + ChecksumOf(foam_))) << file;
    EXPECT_THAT(metadata, HasSubstr("creator: semfoam "));
    EXPECT_THAT(metadata, HasSubstr("frame: COLMAP"));
  }
}

TEST_F(VolumeExporter, WarnsOfVolumesThatShowNothing) {
  const Outcome outcome = Run("out", {"--voxel_size", "100"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("WARNING: objects/7_mug.vdb: it has no voxel (voxels of 100"));
  EXPECT_THAT(Files("out"), SizeIs(4));
}

TEST_F(VolumeExporter, ABadOptionIsOneSentence) {
  const struct {
    const char* option;
    const char* value;
    const char* says;
  } kBad[] = {
      {"--voxel_size", "-1", "voxel_size"},
      {"--voxel_size", "wide", "'--VolumeExport.voxel_size' is invalid; it takes a number"},
      {"--max_resolution", "0", "max_resolution must be 1..65536"},
      {"--labels", "teapot", "the scene has 7 (mug), 8 (label_8)"},
      {"--crop", "0,0,0,1,1", "six numbers"},
      {"--crop", "1,0,0,0,1,1", "x0 < x1"},
      {"--supersample", "9", "supersample must be 1..8"},
      {"--supersample", "1.5", "an integer"},
      {"--VolumeExport.label_grid_type", "uint8", "{float, int32, both}"},
      {"--VolumeExport.color_grid_name", "", "letters, digits"},
      {"--VolumeExport.color_grid_name", "density", "two are called 'density'"},
      {"--VolumeExport.nvdb", "2", "0, 1, true or false"},
      {"--VolumeExport.points", "yes", "0, 1, true or false"},
      {"--VolumeExport.half_float", "half", "0, 1, true or false"},
      {"--VolumeExport.max_voxels", "0", "max_voxels must be positive"},
      {"--VolumeExport.max_voxels", "10", "choose a voxel size of"},
      {"--VolumeExport.min_optical_depth", "-1", "min_optical_depth"},
      {"--VolumeExport.int32_labels", "1", "int32_labels"},
  };
  for (const auto& [option, value, says] : kBad) {
    const Outcome outcome = Run("out", {option, value});
    EXPECT_EQ(outcome.exit_code, 1) << option << " " << value;
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << option << " " << value << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr(says));
    EXPECT_THAT(Files("out"), testing::IsEmpty()) << option << " " << value;
  }
}

TEST_F(VolumeExporter, ShortNamesAreInTheHelp) {
  const Outcome outcome = RunSemfoam({"volume_exporter", "-h"});
  for (const char* name : {"voxel_size", "max_resolution", "crop", "supersample"}) {
    EXPECT_THAT(outcome.out, HasSubstr(std::string("--VolumeExport.") + name + " arg"));
    EXPECT_THAT(outcome.out, HasSubstr(std::string("--") + name));
  }
  EXPECT_THAT(outcome.out, HasSubstr("--labels arg"));
  EXPECT_THAT(outcome.out, HasSubstr("--VolumeExport.labels"));
}

}  // namespace
}  // namespace semfoam
