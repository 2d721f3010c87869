// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/mask_importing.h"

#include <string>

#include "tests/tools/program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::json;

json Shape(const char* label, const char* type, const json& points) {
  return {{"label", label}, {"shape_type", type}, {"points", points}, {"group_id", nullptr}};
}

json Photo(const char* name, const json& shapes) {
  return {{"shapes", shapes},
          {"imagePath", name},
          {"imageData", nullptr},
          {"imageHeight", 240},
          {"imageWidth", 320}};
}

// How masks of LabelMe's `photos` are corrected by the tracks, where `asked` is asked for.
MaskConsistency ConsistencyOf(const json& photos, MaskConsistency asked) {
  const TempFolder temp;
  WriteFile(temp / "marks.json", photos.dump());
  SceneOptions scene;
  scene.image_path = kTabletop / "images";
  scene.mask_path = temp / "marks.json";
  scene.mask_consistency = asked;
  ImportMasksOf(&scene, temp / "masks");
  EXPECT_EQ(scene.mask_path, temp / "masks");
  return scene.mask_consistency;
}

const json kClicks = {Shape("upper", "point", {{160, 30}}), Shape("lower", "point", {{160, 220}})};
// Of a list of one JSON value, clang makes that value.
const json kArea =
    json::array({Shape("lower", "polygon", {{0, 120}, {320, 120}, {320, 240}, {0, 240}})});

TEST(ImportMasksOf, LeavesNamesToWhoMarkedThings) {
  const json clicks = {Photo("0008.jpg", kClicks), Photo("0044.jpg", kClicks)};
  EXPECT_EQ(ConsistencyOf(clicks, MaskConsistency::kAuto), MaskConsistency::kOff);
  EXPECT_EQ(ConsistencyOf(clicks, MaskConsistency::kTracks), MaskConsistency::kTracks);
}

TEST(ImportMasksOf, LeavesAreasToTheTracks) {
  const json areas = {Photo("0008.jpg", kArea), Photo("0044.jpg", kArea)};
  EXPECT_EQ(ConsistencyOf(areas, MaskConsistency::kAuto), MaskConsistency::kAuto);
  const json both = {Photo("0008.jpg", kArea), Photo("0044.jpg", kClicks)};
  EXPECT_EQ(ConsistencyOf(both, MaskConsistency::kAuto), MaskConsistency::kAuto);
}

}  // namespace
}  // namespace semfoam
