// SPDX-License-Identifier: GPL-3.0-or-later
//
// scene_segmenter as a user meets it, on a ring on a table with a ball in the ring.
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tests/foam/segment/shown_scenes.h"
#include "tests/tools/commands/ring_scene.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::StartsWith;

class SceneSegmenterTest : public testing::Test {
 protected:
  void SetUp() override {
    Model model = RingScene();
    // From above.
    ShowSurfaces([](const Eigen::Vector3f& x) { return x.z() > kTableTop - 0.1f; }, &model);
    WriteModel(Foam(), model);
  }

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
  const Outcome outcome = Segment("out");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(folder_ / "out"), ElementsAre("scene.foam"));
  const Model before = ReadModel(Foam()), after = ReadModel(folder_ / "out/scene.foam");
  EXPECT_EQ(after.foam.positions, before.foam.positions);
  EXPECT_EQ(after.foam.raw_density, before.foam.raw_density);
  EXPECT_EQ(after.foam.sh, before.foam.sh);

  // The label that most cells of each thing have; no two share one.
  const CellLabels truth = LabelCells(before.foam, TriangulateModel(before));
  const CellLabels found = LabelCells(after.foam, TriangulateModel(after));
  std::map<std::string, std::map<std::string, int64_t>> counts;
  std::map<std::string, int64_t> all;
  for (size_t i = 0; i < truth.solid.size(); ++i) {
    const std::string& name = after.labels[Value(found.class_index[i])].name;
    if (truth.solid[i] == 0) {
      EXPECT_EQ(name, "");
      continue;
    }
    ++counts[before.labels[Value(truth.class_index[i])].name][name];
    ++all[before.labels[Value(truth.class_index[i])].name];
  }
  std::map<std::string, std::string> names;
  for (const auto& [thing, of_thing] : counts) {
    const auto most = std::max_element(
        of_thing.begin(), of_thing.end(), [](auto& a, auto& b) { return a.second < b.second; });
    names[thing] = most->first;
    EXPECT_GT(most->second, 0.75 * static_cast<double>(all[thing])) << thing;
  }
  EXPECT_EQ(names["table"], "plane_1");
  EXPECT_THAT(names["ring"], StartsWith("thing_"));
  EXPECT_THAT(names["ball"], StartsWith("thing_"));
  EXPECT_NE(names["ring"], names["ball"]);
}

TEST_F(SceneSegmenterTest, WhatItFindsIsNamedAndExported) {
  ASSERT_EQ(Segment("out").exit_code, 0);
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
  const Outcome outcome = Segment("out");
  EXPECT_THAT(outcome.err, HasSubstr("has labels already"));
  for (const Label& label : ReadModel(folder_ / "out/scene.foam").labels) {
    EXPECT_NE(label.name, "ring");
  }
}

TEST_F(SceneSegmenterTest, BadInputIsOneSentence) {
  const Outcome range = Segment("out", {"--granularity", "1.5"});
  EXPECT_EQ(range.exit_code, 1);
  EXPECT_THAT(range.err, HasSubstr("--granularity 1.5: 0 to 1 would be right."));
  EXPECT_EQ(Segment("out", {"--granularity", "nan"}).exit_code, 1);

  Model model = RingScene();
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
