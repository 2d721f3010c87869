// SPDX-License-Identifier: GPL-3.0-or-later
//
// scene_segmenter as a user meets it, on a table with three things.
#include "foam/edit/class_table.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/foam/segment/shown_scenes.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

class SceneSegmenterTest : public testing::Test {
 protected:
  void SetUp() override { WriteModel(Foam(), TableModel()); }

  fs::path Foam() const { return folder_ / "in.foam"; }

  Outcome Segment(const std::string& name, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"scene_segmenter",
                                          "--foam_path",
                                          Foam().string(),
                                          "--output_path",
                                          (folder_ / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunSemfoam(arguments);
  }

  TempFolder folder_;
};

TEST_F(SceneSegmenterTest, LabelsPlanesAndThings) {
  const Outcome outcome = Segment("out", {"--granularity", "0"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(folder_ / "out"), ElementsAre("scene.foam"));
  const Model before = ReadModel(Foam()), after = ReadModel(folder_ / "out/scene.foam");
  EXPECT_EQ(after.foam.positions, before.foam.positions);
  EXPECT_EQ(after.foam.raw_density, before.foam.raw_density);
  EXPECT_EQ(after.foam.sh, before.foam.sh);

  // The label that most cells of each thing have; no two share one.
  const CellLabels labels = LabelCells(after.foam, TriangulateModel(after));
  std::map<int, std::map<std::string, int64_t>> counts;
  std::map<int, int64_t> all;
  for (size_t i = 0; i < labels.solid.size(); ++i) {
    const std::string& name = after.labels[Value(labels.class_index[i])].name;
    if (labels.solid[i] == 0) {
      EXPECT_EQ(name, "");
      continue;
    }
    const int kind = Table(after.foam.positions[i]);
    ++counts[kind][name];
    ++all[kind];
  }
  std::map<int, std::string> names;
  for (const auto& [kind, of_kind] : counts) {
    const auto most = std::max_element(
        of_kind.begin(), of_kind.end(), [](auto& a, auto& b) { return a.second < b.second; });
    names[kind] = most->first;
    EXPECT_GT(most->second, 0.75 * static_cast<double>(all[kind])) << kind;
  }
  EXPECT_EQ(names[kTop], "plane_1");
  EXPECT_EQ(names[kLeg], "plane_1");
  EXPECT_EQ((std::set<std::string>{names[kBox], names[kPost], names[kSnowman]}),
            (std::set<std::string>{"thing_1", "thing_2", "thing_3"}));
}

TEST_F(SceneSegmenterTest, WhatItFindsIsNamedAndExported) {
  ASSERT_EQ(Segment("out", {"--granularity", "0"}).exit_code, 0);
  const Outcome named = RunSemfoam({"label_editor",
                                    "--foam_path",
                                    (folder_ / "out/scene.foam").string(),
                                    "--output_path",
                                    (folder_ / "named").string(),
                                    "--rename",
                                    "plane_1=table"});
  ASSERT_EQ(named.exit_code, 0) << named.err;
  const Outcome exported = RunSemfoam({"mesh_exporter",
                                       "--foam_path",
                                       (folder_ / "named/scene.foam").string(),
                                       "--output_path",
                                       (folder_ / "meshes").string(),
                                       "--formats",
                                       "ply"});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_THAT(
      FilesBelow(folder_ / "meshes"),
      IsSupersetOf({"objects/1_table.ply", "objects/2_thing_1.ply", "objects/3_thing_2.ply"}));
}

TEST_F(SceneSegmenterTest, LabelsThatAreThereAreReplacedAndThatIsSaid) {
  Model model = TableModel();
  const std::vector<ClassIndex> classes(model.foam.NumSites(), ClassIndex{0});
  SetClasses({{LabelId{9}, MaskId{9}, "ring"}}, classes, &model);
  WriteModel(Foam(), model);
  const Outcome outcome = Segment("out");
  EXPECT_THAT(outcome.err, HasSubstr("has labels already"));
  for (const Label& label : ReadModel(folder_ / "out/scene.foam").labels) {
    EXPECT_NE(label.name, "ring");
  }
}

TEST_F(SceneSegmenterTest, TheLightOfThePhotosGoesAlong) {
  WriteFile(folder_ / "effects.json", "{}");
  ASSERT_EQ(Segment("same").exit_code, 0);
  EXPECT_THAT(FilesBelow(folder_ / "same"), ElementsAre("scene.foam"));
  Model model = ReadModel(Foam());
  model.options["exposure"] = "on";
  WriteModel(Foam(), model);
  ASSERT_EQ(Segment("out").exit_code, 0);
  EXPECT_EQ(ReadFile(folder_ / "out/effects.json"), "{}");
}

TEST_F(SceneSegmenterTest, TheLightOfAnEarlierFoamGoes) {
  const fs::path effects = folder_ / "out/effects.json";
  fs::create_directories(effects.parent_path());
  WriteFile(effects, R"({"photos": {}})");
  const Outcome without = Segment("out");
  ASSERT_EQ(without.exit_code, 0) << without.err;
  EXPECT_THAT(FilesBelow(folder_ / "out"), ElementsAre("scene.foam"));
  EXPECT_THAT(without.err, HasSubstr("Removed " + effects.string()));

  // The same where the photos' light differs, and the file with it is lost.
  Model model = ReadModel(Foam());
  model.options["exposure"] = "on";
  WriteModel(Foam(), model);
  WriteFile(effects, R"({"photos": {}})");
  ASSERT_EQ(Segment("out").exit_code, 0);
  EXPECT_FALSE(fs::exists(effects));

  // In the folder of the foam that was segmented, it is of that one.
  WriteModel(Foam(), TableModel());
  WriteFile(folder_ / "effects.json", "{}");
  ASSERT_EQ(Segment(".").exit_code, 0);
  EXPECT_EQ(ReadFile(folder_ / "effects.json"), "{}");
}

TEST_F(SceneSegmenterTest, BadInputIsOneSentence) {
  const Outcome range = Segment("out", {"--granularity", "1.5"});
  EXPECT_EQ(range.exit_code, 1);
  EXPECT_THAT(range.err, HasSubstr("--granularity is 1.5; it must be 0 to 1."));
  EXPECT_EQ(Segment("out", {"--granularity", "nan"}).exit_code, 1);

  Model model = TableModel();
  model.statistics = {};
  WriteModel(Foam(), model);
  const Outcome unknown = Segment("out");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("does not say what photos show of its cells"));

  std::fill(model.foam.raw_density.begin(), model.foam.raw_density.end(), -10.f);
  ShowSurfaces(IsAnywhere, &model);
  WriteModel(Foam(), model);
  const Outcome empty = Segment("out");
  EXPECT_EQ(empty.exit_code, 1);
  EXPECT_THAT(empty.err, HasSubstr("shows no surface that could be cut"));
  EXPECT_FALSE(fs::exists(folder_ / "out/scene.foam"));
}

}  // namespace
}  // namespace semfoam
