// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/object_selection.h"

#include "foam/error.h"

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;

std::vector<int32_t> Ids(const ExportableScene& scene, const std::string& labels) {
  std::vector<int32_t> ids;
  for (const ObjectInfo* object : SelectObjects(scene, labels)) ids.push_back(object->id);
  return ids;
}

std::string Error(const ExportableScene& scene, const std::string& labels) {
  try {
    SelectObjects(scene, labels);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

ExportableScene TestScene() {
  Model model = TouchingBalls(400);
  // A label that no cell has.
  model.labels.push_back({9, 9, "ghost"});
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
  EXPECT_EQ(Error(scene, "mug, cup"),
            "The labels to export name 'cup', which is no object; the scene has 7 (mug), 8 "
            "(label_8).");
  EXPECT_EQ(Error(scene, "ghost"),
            "The labels to export name 'ghost', a label without solid cells; the scene has 7 "
            "(mug), 8 (label_8).");
  EXPECT_NE(Error(scene, "mug,,8"), "");
  EXPECT_NE(Error(scene, " "), "");
  EXPECT_NE(Error(scene, "07"), "");
  const ExportableScene air =
      MakeExportableScene(MakeModel(RandomSites(50, 1), 1, [](const auto&) { return kAir; }));
  EXPECT_EQ(Error(air, "1"),
            "The labels to export name '1', which is no object; the scene has no objects.");
}

}  // namespace
}  // namespace semfoam
