// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_selection.h"

#include "foam/util/error.h"

#include "tests/export/test_foams.h"
#include "tests/mistake.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;

std::vector<int32_t> Ids(const ExportableScene& scene, const std::string& labels) {
  std::vector<int32_t> ids;
  for (const ObjectInfo* object : SelectObjects(scene, LabelChoice{labels}))
    ids.push_back(Value(object->id));
  return ids;
}

std::string Error(const ExportableScene& scene, const std::string& labels) {
  try {
    SelectObjects(scene, LabelChoice{labels});
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

ExportableScene TestScene() {
  Model model = TouchingBalls(400);
  // A label that no cell has.
  model.labels.push_back({LabelId{9}, MaskId{9}, "ghost"});
  model.foam.num_classes = 3;
  model.foam.classifier_bias.push_back(-100);
  model.foam.classifier_weight.resize(3 * kIdentityDim, 0.f);
  return MakeExportableScene(model);
}

TEST(ObjectSelection, TakesIdsAndNames) {
  const ExportableScene scene = TestScene();
  EXPECT_THAT(Ids(scene, ""), ElementsAre(7, 8));
  EXPECT_THAT(Ids(scene, "mug"), ElementsAre(7));
  EXPECT_THAT(Ids(scene, "8"), ElementsAre(8));
  EXPECT_THAT(Ids(scene, "label_8 , 7,mug"), ElementsAre(7, 8));
}

TEST(ObjectSelection, SaysWhatThereIs) {
  const ExportableScene scene = TestScene();
  EXPECT_THAT(Error(scene, "mug, cup"),
              NamesMistake("", {"'cup'", "7 (mug)", "8 (label_8)"}, "is no object"));
  EXPECT_THAT(Error(scene, "ghost"),
              NamesMistake("", {"'ghost'", "7 (mug)", "8 (label_8)"}, "without solid cells"));
  EXPECT_NE(Error(scene, "mug,,8"), "");
  EXPECT_NE(Error(scene, " "), "");
  EXPECT_NE(Error(scene, "07"), "");
  const ExportableScene air =
      MakeExportableScene(MakeModel(RandomSites(50, 1), 1, [](const auto&) { return kAir; }));
  EXPECT_THAT(Error(air, "1"), NamesMistake("", {"'1'", "is no object"}, "has no objects"));
}

TEST(ObjectSelection, TakesOneObjectWhereAnIdIsAnotherOnesName) {
  Model model = TouchingBalls(400);
  model.labels[1].name = "7";
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_THAT(Error(scene, "7"),
              NamesMistake("", {"'7'", "mug (7)", "label 8", "id:7", "name:7"}, "is ambiguous"));
  EXPECT_THAT(Ids(scene, "id:7"), ElementsAre(7));
  EXPECT_THAT(Ids(scene, "name:7"), ElementsAre(8));
  LabelFilter picked;
  picked.only.emplace({LabelId{7}});
  EXPECT_EQ(SelectObjects(scene, picked).size(), 1u);
}

TEST(ObjectSelection, LeavesOutWhatIsExcluded) {
  const ExportableScene scene = TestScene();
  const auto ids = [&](const LabelChoice& choice) {
    std::vector<int32_t> found;
    for (const ObjectInfo* object : SelectObjects(scene, choice))
      found.push_back(Value(object->id));
    return found;
  };
  EXPECT_THAT(ids({"", "mug"}), ElementsAre(8));
  EXPECT_THAT(ids({"mug,8", "8"}), ElementsAre(7));
  EXPECT_THROW(SelectObjects(scene, LabelChoice{"", "cup"}), UserError);
  EXPECT_THROW(SelectObjects(scene, LabelChoice{"", "ghost"}), UserError);
  EXPECT_THROW(SelectObjects(scene, LabelChoice{"mug", "7"}), UserError);
}

// Cells of no object stay where objects are excluded, but for those of the excluded labels.
TEST(ObjectSelection, SaysOfEveryCellWhetherItIsMeant) {
  ExportableScene scene = TestScene();
  const uint32_t lost = scene.objects[0].cells.front();
  const uint32_t mug = scene.objects[0].cells.back();
  const uint32_t other = scene.objects[1].cells.front();
  scene.object_of_cell[lost] = -1;
  const LabelFilter without = FilterObjects(scene, {"", "mug"});
  EXPECT_FALSE(HasCell(scene, without, lost));
  EXPECT_FALSE(HasCell(scene, without, mug));
  EXPECT_TRUE(HasCell(scene, without, other));
  const LabelFilter alone = FilterObjects(scene, {"mug"});
  EXPECT_FALSE(HasCell(scene, alone, lost));
  EXPECT_TRUE(HasCell(scene, alone, mug));
  EXPECT_FALSE(HasCell(scene, alone, other));
  for (const uint32_t cell : {lost, mug, other}) EXPECT_TRUE(HasCell(scene, {}, cell));
}

// After a training, what it made nothing of is told and the rest is written.
TEST(ObjectSelection, ListsLabelsWithoutObjectsWhereAskedTo) {
  const ExportableScene scene = TestScene();
  std::vector<std::string> without;
  const LabelFilter filter = FilterObjects(scene, {"ghost, mug"}, &without);
  EXPECT_THAT(without, ElementsAre("ghost (9)"));
  EXPECT_EQ(SelectObjects(scene, filter).size(), 1u);
  without.clear();
  EXPECT_TRUE(SelectObjects(scene, FilterObjects(scene, {"ghost"}, &without)).empty());
  EXPECT_THAT(without, ElementsAre("ghost (9)"));
  EXPECT_THROW(FilterObjects(scene, {"teapot"}, &without), UserError);
}

}  // namespace
}  // namespace semfoam
