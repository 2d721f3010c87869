// SPDX-License-Identifier: GPL-3.0-or-later
//
// label_editor as a user meets it, on a ring on a table with a ball in the ring.
#include "foam/edit/label_editing.h"
#include "foam/model/cell_labels.h"
#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <map>

#include "tests/tools/commands/ring_scene.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

using CellsByName = std::map<std::string, std::vector<uint32_t>>;

// The solid cells of each label but id 0, without labels that have none.
CellsByName ObjectsOf(const Model& model) {
  const CellLabels labels = LabelCells(model.foam, TriangulateModel(model));
  CellsByName objects;
  for (uint32_t i = 0; i < labels.solid.size(); ++i) {
    const Label& label = model.labels[Value(labels.class_index[i])];
    if (labels.solid[i] != 0 && label.id != kNoObject) objects[label.name].push_back(i);
  }
  return objects;
}

class LabelEditorTest : public testing::Test {
 protected:
  void SetUp() override {
    WriteModel(Foam(), RingScene());
    before_ = ObjectsOf(ReadModel(Foam()));
    ASSERT_EQ(before_.size(), 3u);
  }

  fs::path Foam() const { return folder_ / "in.foam"; }

  // Edits the foam into the folder `name`. Expects that nothing but labels changes.
  Model Edit(const std::string& name, const std::vector<std::string>& arguments) const {
    return EditFoam(Foam(), name, arguments);
  }

  Model EditFoam(const fs::path& foam,
                 const std::string& name,
                 std::vector<std::string> arguments) const {
    arguments.insert(
        arguments.begin(),
        {"label_editor", "--foam_path", foam.string(), "--output_path", (folder_ / name).string()});
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(FilesBelow(folder_ / name), ElementsAre("scene.foam"));
    Model edited = ReadModel(folder_ / name / "scene.foam");
    const Model original = ReadModel(Foam());
    EXPECT_EQ(edited.foam.raw_density, original.foam.raw_density);
    EXPECT_EQ(edited.foam.sh, original.foam.sh);
    EXPECT_EQ(edited.foam.positions, original.foam.positions);
    return edited;
  }

  TempFolder folder_;
  CellsByName before_;
};

std::vector<uint32_t> Together(std::vector<uint32_t> a, const std::vector<uint32_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end());
  return a;
}

TEST_F(LabelEditorTest, Renames) {
  const CellsByName objects = ObjectsOf(Edit("out", {"--rename", "ring=bagel"}));
  EXPECT_EQ(objects.at("bagel"), before_.at("ring"));
  EXPECT_EQ(objects.at("ball"), before_.at("ball"));
  EXPECT_EQ(objects.size(), 3u);
}

TEST_F(LabelEditorTest, MergesAndSplitsAgain) {
  const Model merged = Edit("merged", {"--merge", "ring,12"});
  EXPECT_EQ(merged.labels.size(), 2u);
  const CellsByName one = ObjectsOf(merged);
  EXPECT_EQ(one.at("ring"), Together(before_.at("ring"), before_.at("ball")));
  EXPECT_EQ(one.at("table"), before_.at("table"));
  const CellsByName again =
      ObjectsOf(EditFoam(folder_ / "merged/scene.foam", "again", {"--split", "ring"}));
  EXPECT_EQ(again.at("ring"), before_.at("ring"));
  EXPECT_EQ(again.at("ring_2"), before_.at("ball"));
  EXPECT_EQ(again.size(), 3u);
}

TEST_F(LabelEditorTest, KeepsWhatIsKnownOfLabels) {
  Model model = ReadModel(Foam());
  model.labels[0].features = {"toy", 0.5, {0.6f, 0.8f}};
  model.labels[2].features = {"toy", 0.75, {1, 0}};
  WriteModel(Foam(), model);
  // Both of the class, into the first of them.
  const Model merged = Edit("merged", {"--merge", "toy"});
  ASSERT_EQ(merged.labels.size(), 2u);
  EXPECT_EQ(merged.labels[0].features, model.labels[0].features);
  EXPECT_EQ(merged.labels[1].features, LabelFeatures{});
  const Model again = EditFoam(folder_ / "merged/scene.foam", "again", {"--split", "ring"});
  ASSERT_EQ(again.labels.size(), 3u);
  EXPECT_EQ(again.labels[2].name, "ring_2");
  EXPECT_EQ(again.labels[2].features, model.labels[0].features);
  const Outcome extracted = RunSemfoam({"object_extractor",
                                        "--foam_path",
                                        Foam().string(),
                                        "--output_path",
                                        (folder_ / "toys").string(),
                                        "--labels",
                                        "toy"});
  EXPECT_EQ(extracted.exit_code, 0) << extracted.err;
  EXPECT_THAT(extracted.err, HasSubstr("Extracted ring (10), ball (12): "));
  const Model toys = ReadModel(folder_ / "toys/scene.foam");
  for (const Label& label : toys.labels) {
    if (label.name == "ball") {
      EXPECT_EQ(label.features, model.labels[2].features);
    }
  }
  ExpectRefused(RunSemfoam({"object_extractor",
                            "--foam_path",
                            Foam().string(),
                            "--output_path",
                            (folder_ / "none").string(),
                            "--labels",
                            "toys"}),
                {"", {"'toys'", "is 'toy' meant"}, "which is no object"});
}

TEST_F(LabelEditorTest, Drops) {
  const CellsByName objects = ObjectsOf(Edit("out", {"--drop", "ball,table"}));
  EXPECT_EQ(objects.size(), 1u);
  EXPECT_EQ(objects.at("ring"), before_.at("ring"));
}

TEST_F(LabelEditorTest, AssignsByBoxAndByPixel) {
  // The ball, in the frame of the COLMAP model.
  const Model model = ReadModel(Foam());
  Eigen::AlignedBox3d box;
  for (const uint32_t cell : before_.at("ball")) {
    box.extend(model.world_from_normalized.Apply(model.foam.positions[cell].cast<double>()));
  }
  std::string text;
  for (const Eigen::Vector3d& corner : {box.min(), box.max()}) {
    for (int i = 0; i < 3; ++i) text += (text.empty() ? "" : ",") + std::to_string(corner[i]);
  }
  const CellsByName boxed = ObjectsOf(Edit("box", {"--assign", "new", "--box", text}));
  ASSERT_TRUE(boxed.contains("new"));
  // Six digits may lose the cells at the corners.
  EXPECT_GE(boxed.at("new").size() + 6, before_.at("ball").size());
  // The middle of a photo shows the ball in the ring; its cells become the table's.
  const CellsByName picked =
      ObjectsOf(Edit("pick", {"--assign", "table", "--pick", "p, 0.png,40,40"}));
  EXPECT_EQ(picked.at("table"), Together(before_.at("table"), before_.at("ball")));
  EXPECT_FALSE(picked.contains("ball"));
}

TEST_F(LabelEditorTest, AssignsWhatAnOutlineGoesAround) {
  // The photo's left half: the parts in it, front and back, of ring and table. The ball is shown by
  // too few pixels to be meant.
  const Model model = ReadModel(Foam());
  const PhotoRecord& photo = model.photos[0];
  const Pose pose = PoseOf(photo);
  const auto is_left = [&](uint32_t cell) {
    const Eigen::Vector3d x = pose.UnitRotation() * model.world_from_normalized.Apply(
                                                        model.foam.positions[cell].cast<double>()) +
                              pose.translation;
    return photo.camera_params[0] * x.x() / x.z() + photo.camera_params[2] < 40;
  };
  const CellsByName objects =
      ObjectsOf(Edit("out", {"--assign", "half", "--outline", "p, 0.png,-1,-1,40,-1,40,90,-1,90"}));
  const std::vector<uint32_t>& half = objects.at("half");
  EXPECT_TRUE(std::all_of(half.begin(), half.end(), is_left));
  const std::vector<uint32_t> both = Together(before_.at("ring"), before_.at("table"));
  const auto left = std::count_if(both.begin(), both.end(), is_left);
  EXPECT_GE(static_cast<double>(half.size()), 0.99 * static_cast<double>(left));
  EXPECT_LE(std::ssize(half), left);
  EXPECT_EQ(objects.at("ball"), before_.at("ball"));
  // The same from a file.
  WriteFile(folder_ / "edits.json",
            R"({"edits": [{"assign": "half", "outline": "p, 0.png,-1,-1,40,-1,40,90,-1,90"}]})");
  EXPECT_EQ(ObjectsOf(Edit("file", {"--edits_path", (folder_ / "edits.json").string()})), objects);
}

TEST_F(LabelEditorTest, TakesEditsFromAFileInTheirOrder) {
  WriteFile(folder_ / "edits.json",
            R"({"edits": [{"rename": "ball", "to": "apple"}, {"merge": "apple,ring"},
                {"rename": "apple", "to": "both"}, {"drop": "table"}]})");
  const CellsByName objects =
      ObjectsOf(Edit("out", {"--edits_path", (folder_ / "edits.json").string()}));
  EXPECT_EQ(objects.size(), 1u);
  EXPECT_EQ(objects.at("both"), Together(before_.at("ring"), before_.at("ball")));
}

TEST_F(LabelEditorTest, SaysWhatIsWrong) {
  const std::vector<std::string> command = {"label_editor",
                                            "--foam_path",
                                            Foam().string(),
                                            "--output_path",
                                            (folder_ / "failed").string()};
  const auto file = [&](const std::string& name, const std::string& text) {
    WriteFile(folder_ / name, text);
    return std::vector<std::string>{"--edits_path", (folder_ / name).string()};
  };
  ExpectEachRefused(
      command,
      {{{}, {"", {"rename"}, "nothing to do"}},
       {{"--rename", "ring"}, {"", {"rename", "'ring'"}, "is invalid"}},
       {{"--assign", "x", "--outline", "p, 0.png,1,1,9,9"},
        {"", {"outline", "'p, 0.png,1,1,9,9'"}, "three corners or more"}},
       {{"--assign", "x", "--outline", "q.png,1,1,9,9,1,9"},
        {"in.foam", {"q.png"}, "has no photo"}},
       {{"--assign", "x", "--outline", "p, 0.png,0,0,0,0,0,0"},
        {"in.foam", {"p, 0.png,0,0,0,0,0,0"}, "goes around no object"}},
       {{"--rename", "ring="}, {"", {"rename", "'ring='"}, "is invalid"}},
       {{"--rename", "nobody=x"}, {"in.foam", {"'nobody'"}, "has no label"}},
       {{"--merge", "ring"}, {"in.foam", {"'ring'"}, "two or more"}},
       {{"--drop", "ring,nobody"}, {"in.foam", {"'nobody'"}, "has no label"}},
       {{"--split", "77"}, {"in.foam", {"'77'"}, "has no label"}},
       {{"--assign", "x"}, {"", {"assign", "box", "pick"}, "give one of them"}},
       {{"--box", "0,0,0,1,1,1"}, {"", {"box", "assign"}, "no effect"}},
       {{"--assign", "x", "--box", "0,0,0,1,1"}, {"", {"'0,0,0,1,1'"}, "is invalid"}},
       {{"--assign", "x", "--box", "1e6,0,0,1e7,1,1"}, {"in.foam", {}, "no cell of an object"}},
       {{"--assign", "x", "--pick", "none.png,1,1"}, {"in.foam", {"none.png"}, "has no photo"}},
       {file("a.json", "{}"), {"a.json", {"\"edits\""}, "has no list"}},
       {file("b.json", R"({"edits": [{"rename": "ring"}]})"), {"b.json", {"edit 1"}, "not one of"}},
       {file("c.json", R"({"edits": [{"drop": 7}]})"), {"c.json", {"\"drop\""}, "is no text"}},
       {file("d.json", R"({"edits": [{"drop": "7", "split": "8"}]})"),
        {"d.json", {"edit 1"}, "not one of"}},
       {file("e.json", R"({"edits": [3]})"), {"e.json", {"edit 1"}, "not one of"}},
       {file("f.json", R"({"edits": [{"drop": )"), {"f.json", {}, "before its JSON does"}}},
      folder_ / "failed");
}

TEST(ComponentsOf, AreSortedBySize) {
  const Model model = RingScene();
  const Delaunay delaunay = TriangulateModel(model);
  const ObjectCells ring = CellsOf(model, 0), ball = CellsOf(model, 2);
  const auto components = ComponentsOf(Together(ring.cells, ball.cells), delaunay);
  ASSERT_EQ(components.size(), 2u);
  EXPECT_EQ(components[0], ring.cells);
  EXPECT_EQ(components[1], ball.cells);
  EXPECT_TRUE(ComponentsOf({}, delaunay).empty());
}

}  // namespace
}  // namespace semfoam
