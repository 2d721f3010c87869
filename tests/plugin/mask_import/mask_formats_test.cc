// SPDX-License-Identifier: GPL-3.0-or-later
//
// Masks that are written in every format come back as they were.
#include "tests/plugin/mask_import/mask_formats.h"

#include "foam/util/json_file.h"
#include "foam/util/parallel.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask_import/mask_import.h"
#include "plugin/mask_import/yolo_reader.h"

#include <set>

#include "tests/mistake.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Imports IN/masks for the photos in IN/photos into OUT.
MaskImport Import(const fs::path& masks,
                  const fs::path& photos,
                  const fs::path& output,
                  SameName same_name = SameName::kObjects) {
  fs::create_directories(output);
  const std::vector<std::string> names = PhotoNames(photos);
  return ImportMasks(RecognizeMasks(masks, names), photos, names, same_name, output);
}

// Expects that each id of `read` is one of `exact` everywhere. Returns the ids by those of `exact`.
std::map<int, int> ExpectSameRegions(const MaskPng& read, const LabelImage& exact) {
  std::map<int, int> ids;
  EXPECT_EQ(read.width, exact.width);
  EXPECT_EQ(read.height, exact.height);
  if (read.values.size() != exact.data.size()) return ids;
  std::set<int> seen;
  for (size_t i = 0; i < read.values.size(); ++i) {
    const auto id = static_cast<int>(read.values[i]);
    EXPECT_EQ(ids.emplace(exact.data[i], id).first->second, id) << "pixel " << i;
  }
  for (const auto& [exact_id, id] : ids) EXPECT_TRUE(seen.insert(id).second) << id;
  return ids;
}

class MaskFormats : public testing::TestWithParam<FormatSample> {};

TEST_P(MaskFormats, ComeBackIdentical) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  GetParam().write(scene, temp / "masks");
  const MaskImport import = Import(temp / "masks", temp / "photos", temp / "out");
  EXPECT_EQ(import.format, GetParam().format);
  EXPECT_EQ(import.num_masks, 3);
  EXPECT_EQ(import.num_photos, 3);
  EXPECT_EQ(import.are_independent, GetParam().is_independent);
  EXPECT_THAT(import.without_photo, testing::IsEmpty());
  EXPECT_THAT(import.warnings, testing::IsEmpty());
  std::map<int, std::string> names;
  for (const LabelName& name : ReadLabelNames(temp / "out" / "labels.json")) {
    names.emplace(Value(name.id), name.name);
  }
  EXPECT_EQ(names.size(), 3u);
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    const fs::path file = temp / "out" / (scene.PathOf(i) + ".png");
    EXPECT_EQ(ReadMaskHeader(file).bits, 16);
    const std::map<int, int> ids = ExpectSameRegions(ReadMaskPng(file), scene.masks[i]);
    for (const auto& [exact_id, id] : ids) {
      if (exact_id == 0) {
        EXPECT_EQ(id, 0);
      } else if (GetParam().has_names) {
        EXPECT_EQ(names[id], scene.names.at(exact_id));
      } else {
        EXPECT_EQ(id, exact_id);
        EXPECT_EQ(names[id], "label_" + std::to_string(id));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, MaskFormats, testing::ValuesIn(AllFormats()), [](const auto& sample) {
  return sample.param.name;
});

TEST(MaskImport, DoesNotDependOnTheThreads) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  for (const FormatSample& sample : AllFormats()) {
    std::vector<std::string> bytes;
    sample.write(scene, temp / sample.name);
    for (const int threads : {1, 3}) {
      const ThreadLimit limit(threads);
      const fs::path out = temp / (sample.name + std::to_string(threads));
      Import(temp / sample.name, temp / "photos", out);
      std::vector<std::string> files = FilesBelow(out);
      std::sort(files.begin(), files.end());
      EXPECT_EQ(files.size(), 4u);
      std::string all;
      for (const std::string& file : files) all += file + ReadFile(out / file);
      bytes.push_back(all);
    }
    EXPECT_EQ(bytes[0], bytes[1]) << sample.name;
  }
}

TEST(MaskImport, ReadsItsOwnResult) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  WriteFile(temp / "coco.json", CocoText(scene, Shape::kPolygons));
  Import(temp / "coco.json", temp / "photos", temp / "out");
  Import(temp / "out", temp / "photos", temp / "again");
  for (const std::string& file : FilesBelow(temp / "out")) {
    if (file == "labels.json") continue;
    EXPECT_EQ(ReadFile(temp / "out" / file), ReadFile(temp / "again" / file)) << file;
  }
  EXPECT_EQ(ReadLabelNames(temp / "again" / "labels.json").size(), 3u);
}

TEST(MaskImport, PaintsSmallRegionsOnTopOfLargeOnes) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  nlohmann::json coco = CocoOf(scene, Shape::kPolygons, [&](size_t i) { return scene.photos[i]; });
  coco["categories"].push_back({{"id", 4}, {"name", "all"}});
  coco["annotations"].push_back(
      {{"image_id", 7}, {"category_id", 4}, {"segmentation", {{-5, -5, 30, -5, 30, 30, -5, 30}}}});
  WriteFile(temp / "coco.json", coco.dump());
  Import(temp / "coco.json", temp / "photos", temp / "out");
  const MaskPng mask = ReadMaskPng(temp / "out/cam/0001.png");
  for (size_t i = 0; i < mask.values.size(); ++i) {
    const int exact = scene.masks[0].data[i];
    EXPECT_EQ(mask.values[i], exact == 0 ? 4 : exact) << i;
  }
}

TEST(MaskImport, NumbersSeveralObjectsOfOneName) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  nlohmann::json coco = CocoOf(scene, Shape::kPolygons, [&](size_t i) { return scene.photos[i]; });
  for (nlohmann::json& annotation : coco["annotations"]) {
    if (annotation["category_id"] == 2) annotation["category_id"] = 1;
  }
  WriteFile(temp / "coco.json", coco.dump());
  const MaskImport import = Import(temp / "coco.json", temp / "photos", temp / "out");
  std::vector<std::string> names;
  for (const ImportedLabel& label : import.labels) names.push_back(label.name);
  EXPECT_THAT(names, testing::UnorderedElementsAre("mug_1", "mug_2", "plant"));
  ASSERT_EQ(import.warnings.size(), 1u);
  EXPECT_THAT(import.warnings[0], IsOneSentence());
  EXPECT_THAT(import.warnings[0], testing::HasSubstr("mug"));

  const MaskImport one = Import(temp / "coco.json", temp / "photos", temp / "one", SameName::kOne);
  EXPECT_EQ(one.labels.size(), 2u);
  EXPECT_THAT(one.warnings, testing::IsEmpty());

  // With track ids, they are told apart in all photos.
  for (size_t i = 0; i < coco["annotations"].size(); ++i) {
    coco["annotations"][i]["attributes"] = {{"track_id", 40 + i % 3}};
  }
  WriteFile(temp / "coco.json", coco.dump());
  const MaskImport tracked = Import(temp / "coco.json", temp / "photos", temp / "tracked");
  ASSERT_EQ(tracked.labels.size(), 3u);
  EXPECT_EQ(tracked.labels[0].id, 40);
  EXPECT_EQ(tracked.labels[0].name, "mug");
  EXPECT_EQ(tracked.labels[1].name, "mug");
  EXPECT_THAT(tracked.warnings, testing::IsEmpty());
  EXPECT_FALSE(ReadJsonFile(temp / "tracked/labels.json").contains("original_ids"));
}

TEST(MaskImport, TracksThatAreNumberedAnewStayKnown) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  nlohmann::json coco = CocoOf(scene, Shape::kPolygons, [&](size_t i) { return scene.photos[i]; });
  for (nlohmann::json& annotation : coco["annotations"]) {
    const auto category = annotation["category_id"].get<int64_t>();
    annotation["attributes"] = {{"track_id", 100000 * category}};
  }
  WriteFile(temp / "coco.json", coco.dump());
  const MaskImport import = Import(temp / "coco.json", temp / "photos", temp / "out");
  std::set<int64_t> categories;
  for (const nlohmann::json& annotation : coco["annotations"]) {
    categories.insert(annotation["category_id"].get<int64_t>());
  }
  nlohmann::json original_ids;
  for (const int64_t category : categories) {
    original_ids[std::to_string(original_ids.size() + 1)] = 100000 * category;
  }
  EXPECT_EQ(import.labels.size(), categories.size());
  EXPECT_EQ(ReadJsonFile(temp / "out/labels.json")["original_ids"], original_ids);
}

TEST(MaskImport, TellsWhatItLeftOut) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  nlohmann::json coco = CocoOf(scene, Shape::kPolygons, [&](size_t i) { return scene.photos[i]; });
  coco["annotations"].push_back({{"image_id", 7}, {"category_id", 1}, {"bbox", {0, 0, 9, 9}}});
  coco["images"].push_back(
      {{"id", 99}, {"file_name", "elsewhere.jpg"}, {"width", 5}, {"height", 5}});
  WriteFile(temp / "masks/coco.json", coco.dump());
  WriteFile(temp / "masks/notes.txt", "nothing\n");
  const MaskImport import = Import(temp / "masks", temp / "photos", temp / "out");
  EXPECT_THAT(import.left_out, testing::ElementsAre("1 annotation without pixels", "1 .txt file"));
  EXPECT_THAT(import.without_photo, testing::ElementsAre("elsewhere.jpg"));
  const std::vector<std::string> lines = DescribeImport(import);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], "COCO annotations: masks of 3 of 3 photos, matched by name; 3 labels");
  EXPECT_EQ(lines[1],
            "Left out: 1 annotation without pixels; 1 .txt file; 1 mask without a photo "
            "(elsewhere.jpg)");
}

TEST(MaskImport, LeavesOtherFilesAlone) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  WriteFile(temp / "coco.json", CocoText(scene, Shape::kPolygons));
  WriteFile(temp / "names/labels.json", R"({"labels": {"7": "mine"}})");
  EXPECT_THAT(UserErrorOf([&] { Import(temp / "coco.json", temp / "photos", temp / "names"); }),
              NamesMistake("names/labels.json", {}, "would be lost"));
  WriteFile(temp / "pngs/cam/0001.png", "mine");
  EXPECT_THAT(UserErrorOf([&] { Import(temp / "coco.json", temp / "photos", temp / "pngs"); }),
              NamesMistake("pngs/cam/0001.png", {}, "mixed up"));
  EXPECT_EQ(FilesBelow(temp / "pngs").size(), 1u);
  // Its own are replaced.
  Import(temp / "coco.json", temp / "photos", temp / "out");
  Import(temp / "coco.json", temp / "photos", temp / "out");
  // A damaged region leaves nothing.
  nlohmann::json coco = CocoOf(scene, Shape::kRawRuns, [&](size_t i) { return scene.photos[i]; });
  coco["annotations"][8]["segmentation"]["counts"][0] = 431;
  WriteFile(temp / "bad.json", coco.dump());
  EXPECT_NE(UserErrorOf([&] { Import(temp / "bad.json", temp / "photos", temp / "bad"); }), "");
  EXPECT_EQ(FilesBelow(temp / "bad").size(), 0u);
}

TEST(YoloNames, AreReadInAllForms) {
  const TempFolder temp;
  for (const char* text : {"names: ['mug', \"ball\"]\n",
                           "nc: 2\nnames: {0: mug, 1: ball}\n",
                           "names:\n  0: mug\n  1: 'ball'\npath: x\n",
                           "names:\n- mug\n# between\n- ball\nnc: 2\n"}) {
    WriteFile(temp / "data.yaml", text);
    const std::map<int, std::string> expected = {{0, "mug"}, {1, "ball"}};
    EXPECT_EQ(ReadYoloNames(temp / "data.yaml"), expected) << text;
  }
}

}  // namespace
}  // namespace semfoam
