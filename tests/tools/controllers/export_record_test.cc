// SPDX-License-Identifier: GPL-3.0-or-later
//
// Every file of an export folder belongs to one foam, and labels.json names those files alone;
// names that a user writes there stay.
#include "foam/model/model.h"

#include <map>
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
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

// Two foams of the same labels, "7_mug" and "8_label_8", each in a folder of its own, and one
// folder for exports.
class ExportRecordTest : public testing::Test {
 protected:
  ExportRecordTest() {
    WriteModel(folder_ / "a/scene.foam", TouchingBalls(1500));
    WriteModel(folder_ / "b/scene.foam", TouchingBalls(1400));
    fs::create_directory(Out());
  }

  fs::path Foam(const std::string& name = "a") const { return folder_ / name / "scene.foam"; }
  fs::path Out() const { return folder_ / "out"; }

  Outcome Export(const std::string& command,
                 const std::string& foam,
                 const std::vector<std::string>& options,
                 const fs::path& output) const {
    return RunExporter(command, Foam(foam), output, options);
  }
  // Returns what it said.
  std::string Meshes(const std::string& foam, const std::vector<std::string>& options = {}) const {
    const Outcome outcome = Export("mesh_exporter", foam, options, Out());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  }
  std::string Volumes(const std::string& foam, std::vector<std::string> options = {}) const {
    options.insert(options.end(), {"--max_resolution", "16"});
    const Outcome outcome = Export("volume_exporter", foam, options, Out());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  }

  json Labels() const { return LabelsIn(Out()); }

  std::set<std::string> Listed() const { return ListedIn(Out()); }

  // labels.json lists every file of the folder, but for those of the user's.
  void ExpectListed(const std::set<std::string>& others = {}) const {
    ExpectAllListed(Out(), others);
  }

  // As a user does, in an editor.
  static void Rename(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = ReadFile(file);
    const std::string before = ": \"" + from + "\"";
    const size_t at = text.find(before);
    ASSERT_NE(at, std::string::npos) << text;
    WriteFile(file, text.replace(at, before.size(), ": \"" + to + "\""));
  }

  const TempFolder folder_;
};

TEST_F(ExportRecordTest, FilesOfAnotherFoamGoAndAreNamed) {
  Volumes("a",
          {"--VolumeExport.nvdb",
           "1",
           "--VolumeExport.points",
           "1",
           "--VolumeExport.label_grid_type",
           "both"});
  Meshes("a");
  ExpectListed();
  EXPECT_EQ(Labels()["source_model_xxh64"], ChecksumOf(Foam("a")));
  const std::set<std::string> of_a = Listed();
  // Beside them, and by their names, what a user put there.
  const std::set<std::string> mine = {"scene.blend", "objects/7_mug.fbx", "objects/9_mine.ply"};
  for (const std::string& file : mine) WriteFile(Out() / file, "mine");

  const std::string said = Meshes("b", {"--formats", "ply"});
  EXPECT_EQ(Labels()["source_model_xxh64"], ChecksumOf(Foam("b")));
  EXPECT_THAT(Listed(), UnorderedElementsAre("objects/7_mug.ply", "objects/8_label_8.ply"));
  ExpectListed(mine);
  EXPECT_THAT(said,
              HasSubstr("Removed objects/7_mug.glb, .mtl, .nvdb, .obj, .om, .vdb: it is of another "
                        "foam"));
  for (const std::string& file : of_a) {
    EXPECT_THAT(said, HasSubstr("Removed " + file.substr(0, file.rfind('.')))) << file;
  }
  for (const std::string& file : mine) EXPECT_EQ(ReadFile(Out() / file), "mine");
}

// The stage is written while they are still there.
TEST_F(ExportRecordTest, TheStageNamesNoVolumeOfAnotherFoam) {
  Volumes("a");
  Meshes("b", {"--formats", "usda"});
  EXPECT_THAT(ReadFile(Out() / "scene.usda"), Not(HasSubstr(".vdb")));
  Volumes("b");
  Meshes("b", {"--formats", "usda"});
  EXPECT_THAT(ReadFile(Out() / "scene.usda"), HasSubstr("objects/7_mug.vdb"));
}

TEST_F(ExportRecordTest, FilesOfObjectsThatAreNoMoreGoAndAreNamed) {
  Volumes("a");
  Meshes("a");
  const json objects = Labels()["objects"];
  ASSERT_EQ(objects.size(), 2u);
  ASSERT_LT(objects[1]["cells"], objects[0]["cells"]);
  const std::string said = Meshes(
      "a", {"--formats", "ply", "--min_cells", std::to_string(objects[1]["cells"].get<int>() + 1)});
  EXPECT_THAT(said,
              HasSubstr("Removed objects/8_label_8.glb, .mtl, .obj, .om, .ply, .vdb: it shows an "
                        "object or a name that is not there any more."));
  // Files of all objects together, which this run did not write anew, still showed it.
  EXPECT_THAT(said, HasSubstr("Removed scene.glb, .usda: it shows an object"));
  EXPECT_THAT(FilesBelow(Out()),
              UnorderedElementsAre("labels.json",
                                   "scene.vdb",
                                   "objects/7_mug.vdb",
                                   "objects/7_mug.om",
                                   "objects/7_mug.ply",
                                   "objects/7_mug.obj",
                                   "objects/7_mug.mtl",
                                   "objects/7_mug.glb"));
  ExpectListed();
}

TEST_F(ExportRecordTest, AFileThatNoExportWroteIsNotListed) {
  fs::create_directory(Out() / "objects");
  WriteFile(Out() / "objects/7_mug.obj", "mine");
  WriteFile(Out() / "scene.glb", "mine");
  Meshes("a", {"--formats", "ply"});
  EXPECT_THAT(Listed(), UnorderedElementsAre("objects/7_mug.ply", "objects/8_label_8.ply"));
  Meshes("b", {"--formats", "ply"});
  EXPECT_EQ(ReadFile(Out() / "objects/7_mug.obj"), "mine");
  EXPECT_EQ(ReadFile(Out() / "scene.glb"), "mine");
}

TEST_F(ExportRecordTest, PathsThatNoExportWritesAreLeftAlone) {
  Meshes("a", {"--formats", "ply"});
  const std::vector<std::string> precious = {
      "precious.ply", "out/precious.ply", "out/objects/precious.ply", "out/scene.blend"};
  for (const std::string& file : precious) WriteFile(folder_ / file, "mine");
  json labels = Labels();
  labels["files"] = {{"a", "../precious.ply"},
                     {"b", (folder_ / "precious.ply").string()},
                     {"c", "precious.ply"},
                     {"d", "objects/precious.ply"},
                     {"e", "objects/7_mug/../precious.ply"},
                     {"f", "objects/../../precious.ply"},
                     {"g", "scene.blend"},
                     {"h", ""},
                     {"i", "objects"},
                     {"j", 7}};
  WriteFile(Out() / "labels.json", labels.dump());
  EXPECT_THAT(Meshes("b", {"--formats", "glb"}), Not(HasSubstr("precious")));
  for (const std::string& file : precious) EXPECT_EQ(ReadFile(folder_ / file), "mine") << file;
}

// As a version of the program wrote it that did not say of which foam the files are.
TEST_F(ExportRecordTest, FilesOfAnUnknownFoamStayAndAreNotListed) {
  Volumes("a");
  json labels = Labels();
  labels.erase("source_model_xxh64");
  labels["labels"]["7"] = "cup";
  WriteFile(Out() / "labels.json", labels.dump());
  const std::string said = Meshes("a", {"--formats", "ply"});
  EXPECT_THAT(said,
              HasSubstr("does not say of which foam its files are: these stay and are listed no "
                        "more: scene.vdb; objects/7_mug.vdb; objects/8_label_8.vdb"));
  EXPECT_THAT(said, HasSubstr("so they are not taken (7 is cup)"));
  EXPECT_TRUE(fs::exists(Out() / "objects/7_mug.vdb"));
  EXPECT_THAT(Listed(), UnorderedElementsAre("objects/7_mug.ply", "objects/8_label_8.ply"));
}

TEST_F(ExportRecordTest, AnotherVersionOfTheRecordIsLeftAlone) {
  Meshes("a", {"--formats", "ply"});
  json labels = Labels();
  labels["version"] = 2;
  WriteFile(Out() / "labels.json", labels.dump());
  const Outcome outcome = Export("mesh_exporter", "a", {}, Out());
  ExpectRefused(outcome,
                {(Out() / "labels.json").string(),
                 {"version 2", "version 1", "output_path"},
                 "format version"});
  EXPECT_EQ(ReadFile(Out() / "labels.json"), labels.dump());
}

TEST_F(ExportRecordTest, ExportsDoNotGoBesideAnotherFoam) {
  Meshes("a");
  for (const std::string command : {"mesh_exporter", "volume_exporter"}) {
    const Outcome outcome = Export(command, "a", {}, folder_ / "b");
    ExpectRefused(outcome, {Foam("b").string(), {"output_path"}, "is another foam"});
  }
  EXPECT_THAT(FilesBelow(folder_ / "b"), testing::ElementsAre("scene.foam"));
  // A copy is the same foam.
  fs::copy_file(Foam("a"), folder_ / "out/scene.foam");
  Meshes("a");
}

TEST_F(ExportRecordTest, AnEditLeavesATrainedFoamAndTellsOfExportsOfAnother) {
  const auto extract = [&](const std::string& labels) {
    return RunSemfoam({"object_extractor",
                       "--foam_path",
                       Foam().string(),
                       "--labels",
                       labels,
                       "--output_path",
                       Out().string()});
  };
  EXPECT_EQ(extract("7").exit_code, 0);
  EXPECT_EQ(RunSemfoam({"mesh_exporter",
                        "--foam_path",
                        (Out() / "scene.foam").string(),
                        "--output_path",
                        Out().string()})
                .exit_code,
            0);
  EXPECT_THAT(extract("7").err, Not(HasSubstr("WARNING")));  // the same foam again
  EXPECT_THAT(extract("8").err,
              HasSubstr("WARNING: " + (Out() / "labels.json").string() +
                        " and the files that it lists are of the foam that was here before"));
  WriteFile(Out() / "training_log.csv", "seconds\n");
  const std::string trained = ReadFile(Out() / "scene.foam");
  const Outcome refused = extract("7");
  ExpectRefused(
      refused,
      {(Out() / "scene.foam").string(), {"output_path", "would be lost"}, "holds a trained foam"});
  EXPECT_EQ(ReadFile(Out() / "scene.foam"), trained);
}

// In labels.json, the names of files, and what the files hold.
TEST_F(ExportRecordTest, NamesThatAUserChangedStay) {
  Volumes("a");
  Meshes("a");
  Rename(Out() / "labels.json", "mug", "Ann's cup");
  std::string said = Meshes("a");
  said += Volumes("a");
  EXPECT_THAT(said,
              HasSubstr("Names from " + (Out() / "labels.json").string() + ": 7 is Ann's cup"));
  EXPECT_EQ(Labels()["labels"]["7"], "Ann's cup");
  EXPECT_EQ(Labels()["objects"][0]["name"], "Ann's cup");
  EXPECT_EQ(Labels()["objects"][0]["files"]["ply"], "objects/7_Ann_s_cup.ply");
  ExpectListed();
  EXPECT_THAT(FilesBelow(Out()), testing::Each(Not(HasSubstr("mug"))));
  EXPECT_THAT(said, HasSubstr("Removed objects/7_mug.glb, .mtl, .obj, .om, .ply, .vdb: "));
  EXPECT_THAT(ReadFile(Out() / "scene.usda"), HasSubstr("Ann's cup"));
  EXPECT_THAT(ReadFile(Out() / "scene.glb"), HasSubstr("Ann's cup"));
  EXPECT_THAT(ReadFile(Out() / "scene.glb"), Not(HasSubstr("mug")));
  const Outcome metadata =
      RunProgram("vdb_print", {"-m", (Out() / "objects/7_Ann_s_cup.vdb").string()});
  EXPECT_THAT(metadata.out, HasSubstr("object_name: Ann's cup"));
  EXPECT_THAT(metadata.out, Not(HasSubstr("mug")));
  // And once more, with nothing to be removed.
  EXPECT_THAT(Meshes("a"), Not(HasSubstr("Removed")));
  EXPECT_EQ(Labels()["labels"]["7"], "Ann's cup");
  // Of another foam they are not.
  EXPECT_THAT(Meshes("b"), Not(HasSubstr("Names from")));
  EXPECT_EQ(Labels()["labels"]["7"], "mug");
}

TEST_F(ExportRecordTest, NamesBesideTheFoamAreTakenByAllThatNames) {
  const fs::path beside = folder_ / "a/labels.json";
  EXPECT_EQ(Export("mesh_exporter", "a", {"--formats", "ply"}, folder_ / "a").exit_code, 0);
  Rename(beside, "mug", "cup");
  Meshes("a", {"--formats", "ply"});
  EXPECT_EQ(Labels()["labels"]["7"], "cup");
  const auto run = [&](const std::string& command, const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {command};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out + outcome.err;
  };
  const std::string foam = Foam().string();
  EXPECT_THAT(run("foam_analyzer", {"--foam_path", foam}), HasSubstr("cup"));
  EXPECT_THAT(
      run("object_extractor",
          {"--foam_path", foam, "--labels", "cup", "--output_path", (folder_ / "cup").string()}),
      HasSubstr("Extracted cup (7)"));
  EXPECT_EQ(ReadModel(folder_ / "cup/scene.foam").labels[0].name, "cup");
  run("object_remover",
      {"--foam_path", foam, "--labels", "cup", "--output_path", (folder_ / "rest").string()});
  run("foam_converter",
      {"--input_path",
       foam,
       "--output_path",
       (folder_ / "cup.ply").string(),
       "--output_type",
       "splats",
       "--labels",
       "cup"});
}

TEST_F(ExportRecordTest, OfSeveralNamesTheNearestIsTaken) {
  EXPECT_EQ(Export("mesh_exporter", "a", {"--formats", "ply"}, folder_ / "a").exit_code, 0);
  Meshes("a", {"--formats", "ply"});
  // Both changed: the output folder's, with a warning.
  Rename(folder_ / "a/labels.json", "mug", "beaker");
  Rename(Out() / "labels.json", "mug", "cup");
  EXPECT_THAT(Meshes("a", {"--formats", "ply"}),
              HasSubstr("WARNING: Label 7 is cup by " + (Out() / "labels.json").string() +
                        ", not beaker, as " + (folder_ / "a/labels.json").string() + " has it; "));
  EXPECT_EQ(Labels()["labels"]["7"], "cup");
  // What is said on the command line has the last word, for the labels that it names.
  WriteFile(folder_ / "names.json", R"({"labels": {"8": "saucer"}})");
  Meshes("a", {"--formats", "ply", "--labels_path", (folder_ / "names.json").string()});
  EXPECT_EQ(Labels()["labels"], (json{{"7", "cup"}, {"8", "saucer"}}));
  WriteFile(folder_ / "names.json", R"({"labels": {"7": "goblet"}})");
  Volumes("a", {"--labels_path", (folder_ / "names.json").string()});
  EXPECT_EQ(Labels()["labels"], (json{{"7", "goblet"}, {"8", "saucer"}}));
  ExpectListed();
  const Outcome missing =
      Export("mesh_exporter", "a", {"--labels_path", (folder_ / "none").string()}, Out());
  EXPECT_EQ(missing.exit_code, 1);
  ASSERT_EQ(missing.Errors().size(), 1u);
  EXPECT_THAT(missing.Errors()[0], HasSubstr("none: there is no such file"));
}

TEST_F(ExportRecordTest, NamesThatCannotBeTakenAreTold) {
  Meshes("a", {"--formats", "ply"});
  const json labels = Labels();
  const auto said_of = [&](const json& changed) {
    WriteFile(Out() / "labels.json", changed.dump());
    return Meshes("a", {"--formats", "ply"});
  };
  json changed = labels;
  changed["labels"]["99"] = "ghost";
  EXPECT_THAT(said_of(changed), HasSubstr("names labels that the foam does not have: 99 is ghost"));
  changed = labels;
  changed["objects"][0]["name"] = "cup";
  EXPECT_THAT(said_of(changed), HasSubstr("has other names under \"objects\" (7 is cup)"));
  // Broken while it was edited: nothing is written over it.
  const std::string broken = labels.dump() + "}";
  WriteFile(Out() / "labels.json", broken);
  const Outcome outcome = Export("mesh_exporter", "a", {}, Out());
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_EQ(outcome.Errors().size(), 1u);
  EXPECT_THAT(outcome.Errors()[0], HasSubstr("labels.json: is no valid JSON from byte"));
  EXPECT_EQ(ReadFile(Out() / "labels.json"), broken);
}

}  // namespace
}  // namespace semfoam
