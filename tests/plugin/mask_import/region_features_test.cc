// SPDX-License-Identifier: GPL-3.0-or-later
//
// Classes, scores and embeddings of regions beside masks.
#include "plugin/mask_import/region_features.h"

#include "plugin/mask_import/mask_import.h"
#include "plugin/mask_import/mask_recognition.h"

#include <cstdint>
#include <limits>
#include <utility>

#include "tests/mistake.h"
#include "tests/plugin/mask_import/mask_formats.h"
#include "tests/plugin/mask_import/npy_bytes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using Json = nlohmann::json;

std::string Text(const Json& regions) {
  return Json{{"version", 1}, {"masks", {{"a/b.png", {{"regions", regions}}}}}}.dump();
}

FeaturesOfMasks Read(const fs::path& file, const std::string& text) {
  WriteFile(file, text);
  return ReadRegionFeatures(file);
}

TEST(RegionFeatures, ComeBackAsTheyWereWritten) {
  const TempFolder temp;
  EXPECT_TRUE(FindRegionFeatures(temp.path()).empty());
  EXPECT_TRUE(FindRegionFeatures("").empty());
  FeaturesOfMasks features;
  features["a/b.png"] = {{{MaskId{7}, "mug", 0.1 + 0.2}, {MaskId{0xffffff}, "", {}}}, "a/b.npy"};
  features["c.png"] = {{{MaskId{0}, "a \"wall\"", {}}}, ""};
  features["d.png"] = {};
  WriteRegionFeatures(temp.path(), features);
  const fs::path file = FindRegionFeatures(temp.path());
  ASSERT_EQ(file, temp / "region_features.json");
  const FeaturesOfMasks read = ReadRegionFeatures(file);
  ASSERT_EQ(read.size(), 3u);
  for (const auto& [name, mask] : features) {
    EXPECT_EQ(read.at(name).embeddings, mask.embeddings);
    ASSERT_EQ(read.at(name).regions.size(), mask.regions.size());
    for (size_t i = 0; i < mask.regions.size(); ++i) {
      EXPECT_EQ(read.at(name).regions[i].id, mask.regions[i].id);
      EXPECT_EQ(read.at(name).regions[i].class_name, mask.regions[i].class_name);
      EXPECT_EQ(read.at(name).regions[i].score, mask.regions[i].score);
    }
  }
  EXPECT_THAT(ClassesIn(read), ElementsAre("a \"wall\"", "mug"));
}

TEST(RegionFeatures, OfAnotherFormAreRefused) {
  const TempFolder temp;
  const fs::path file = temp / "region_features.json";
  const Json region = {{"id", 7}, {"class", "mug"}, {"score", 0.5}};
  ASSERT_EQ(Read(file, Text(Json::array({region}))).at("a/b.png").regions.size(), 1u);
  const struct {
    std::string text;
    std::vector<std::string> named;
    const char* kind;
  } cases[] = {
      {Text(Json::array({region})).substr(0, 30), {}, "before its JSON does"},
      {"[]", {"masks"}, "an object with"},
      {"{}", {"masks"}, "has no"},
      {R"({"version": 2, "masks": {}})", {"version", "2"}, "a whole number from 1 to 1"},
      {R"({"masks": []})", {"masks"}, "an object"},
      {R"({"masks": {"a.png": 3}})", {"masks.a.png"}, "an object with"},
      {R"({"masks": {"a.png": {}}})", {"masks.a.png"}, "has no"},
      {R"({"masks": {"a.png": {"regions": {}}}})", {"masks.a.png.regions"}, "a list"},
      {R"({"masks": {"a.png": {"regions": [], "embeddings": "../x.npy"}}})",
       {"masks.a.png.embeddings"},
       "below the folder"},
      {R"({"masks": {"a.png": {"regions": [], "embeddings": 4}}})",
       {"masks.a.png.embeddings"},
       "a text"},
      {Text(Json::array({{{"class", "mug"}}})), {"masks.a/b.png.regions[0]"}, "has no"},
      {Text(Json::array({{{"id", -1}}})), {"masks.a/b.png.regions[0].id"}, "a whole number"},
      {Text(Json::array({{{"id", 1.5}}})), {"masks.a/b.png.regions[0].id"}, "a whole number"},
      {Text(Json::array({{{"id", 4294967296}}})),
       {"masks.a/b.png.regions[0].id"},
       "a whole number"},
      {Text(Json::array({{{"id", 1}, {"class", 3}}})),
       {"masks.a/b.png.regions[0].class"},
       "a text"},
      {Text(Json::array({{{"id", 1}, {"score", "x"}}})),
       {"masks.a/b.png.regions[0].score"},
       "a number"},
      {Text(Json::array({{{"id", 1}, {"score", -0.1}}})),
       {"masks.a/b.png.regions[0].score"},
       "from 0 on"},
      {R"({"masks": {"a.png": {"regions": [{"id": 1, "score": NaN}]}}})", {}, "JSON"},
      {Text({region, region}), {"masks.a/b.png.regions[1].id"}, "of another region"},
  };
  for (const auto& [text, named, kind] : cases) {
    EXPECT_THAT(UserErrorOf([&, &text = text] { Read(file, text); }),
                NamesMistake(file.string(), named, kind))
        << text;
  }
}

TEST(RegionFeatures, EmbeddingsAreReadInAnyPrecisionAndOrder) {
  const TempFolder temp;
  const fs::path file = temp / "a.npy";
  const std::vector<float> exact = {1, -2, 0.5f, 0, 65504, 0.000030517578125f};
  const auto expect_exact = [&](const std::string& bytes) {
    WriteFile(file, bytes);
    const RegionEmbeddings read = ReadRegionEmbeddings(file, 2);
    EXPECT_EQ(read.dimension, 3u);
    EXPECT_EQ(read.values, exact);
    EXPECT_THAT(read.Row(1), ElementsAre(0, 65504, 0.000030517578125f));
  };
  expect_exact(NpyBytes("<f4", "2, 3", BytesOf(exact)));
  expect_exact(NpyBytes("<f8", "2, 3", BytesOf<double>({exact.begin(), exact.end()})));
  // Half precision: 1, -2, 0.5, 0, the largest, and a number below the least normal one.
  const std::vector<uint16_t> halves = {0x3c00, 0xc000, 0x3800, 0, 0x7bff, 0x0200};
  expect_exact(NpyBytes("<f2", "2, 3", BytesOf(halves)));
  std::string swapped = BytesOf(halves);
  for (size_t i = 0; i < swapped.size(); i += 2) std::swap(swapped[i], swapped[i + 1]);
  expect_exact(NpyBytes(">f2", "2, 3", swapped));
  const std::vector<float> columns = {1, 0, -2, 65504, 0.5f, 0.000030517578125f};
  expect_exact(NpyBytes("<f4", "2, 3", BytesOf(columns), true));
}

TEST(RegionFeatures, DamagedEmbeddingsAreRefused) {
  const TempFolder temp;
  const fs::path file = temp / "a.npy";
  const std::string six = BytesOf<float>({1, 2, 3, 4, 5, 6});
  const std::string good = NpyBytes("<f4", "2, 3", six);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const struct {
    std::string bytes;
    std::vector<std::string> named;
    const char* kind;
  } cases[] = {
      {"", {}, "no .npy file"},
      {good.substr(0, 60), {}, "within the header"},
      {good.substr(0, good.size() - 1), {"23", "24"}, "its header promises"},
      {good + "x", {"25", "24"}, "its header promises"},
      {NpyBytes("<u4", "2, 3", six), {"<u4"}, "real numbers"},
      {NpyBytes("|b1", "2, 3", "abcdef"), {"|b1"}, "real numbers"},
      {NpyBytes("<c8", "1, 3", six), {"<c8"}, "real numbers"},
      {NpyBytes("<f3", "2, 4", six), {"<f3"}, "real numbers"},
      {NpyBytes("|O", "2, 3", six), {"|O"}, "real numbers"},
      {NpyBytes("<f4", "3, 2", six), {"3 x 2", "2 x dimension"}, "a row for each region"},
      {NpyBytes("<f4", "6,", six), {"6"}, "a row for each region"},
      {NpyBytes("<f4", "2, 3, 1", six), {"2 x 3 x 1"}, "a row for each region"},
      {NpyBytes("<f4", "2, 0", ""), {"2 x 0"}, "a row for each region"},
      {NpyBytes("<f4", "2, 3", BytesOf<float>({1, 2, 3, 4, nan, 6})), {"row 1"}, "not finite"},
      {NpyBytes("<f2", "2, 1", BytesOf<uint16_t>({0x7c00, 1})), {"row 0"}, "not finite"},
      {NpyBytes("<f8", "2, 1", BytesOf<double>({1, 1e300})), {"row 1"}, "not finite"},
      {NpyBytes("<f4", "2, 3", BytesOf<float>({1, 2, 3, 0, -0.f, 0})), {"row 1"}, "no direction"},
      {NpyBytes("<f8", "2, 1", BytesOf<double>({1, 1e-300})), {"row 1"}, "no direction"},
  };
  for (const auto& [bytes, named, kind] : cases) {
    WriteFile(file, bytes);
    EXPECT_THAT(UserErrorOf([&] { ReadRegionEmbeddings(file, 2); }),
                NamesMistake(file.string(), named, kind))
        << kind;
  }
  EXPECT_THAT(UserErrorOf([&] { ReadRegionEmbeddings(temp / "none.npy", 2); }),
              NamesMistake((temp / "none.npy").string(), {}, "there is no such file"));
}

// Grounded-SAM-2's JSON of one photo: three things of two classes, as it saves scores.
TEST(RegionFeatures, AnImportTakesClassesAndScoresAlong) {
  const TempFolder temp;
  const ExactScene scene;
  scene.WritePhotos(temp / "photos");
  const Json scores[] = {0.9, Json::array({0.75}), nullptr};
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    Json list = RegionListOf(scene, i, true);
    for (int k = 0; k < 3; ++k) {
      list[k]["class_name"] = k == 1 ? "toy" : "pot";
      if (!scores[k].is_null()) list[k]["score"] = scores[k];
    }
    const Json json = {{"image_path", scene.photos[i]}, {"annotations", list}};
    WriteFile(temp / "masks" / (std::to_string(i) + ".json"), json.dump());
  }
  const std::vector<std::string> names = PhotoNames(temp / "photos");
  const auto import = [&](SameName same_name) {
    fs::create_directories(temp / "out");
    ImportMasks(
        RecognizeMasks(temp / "masks", names), temp / "photos", names, same_name, temp / "out");
    return ReadRegionFeatures(FindRegionFeatures(temp / "out"));
  };
  const FeaturesOfMasks features = import(SameName::kObjects);
  EXPECT_EQ(features.size(), 3u);
  const std::vector<RegionFeatures>& regions = features.at("cam/0001.png").regions;
  ASSERT_EQ(regions.size(), 3u);
  EXPECT_THAT(ClassesIn(features), ElementsAre("pot", "toy"));
  EXPECT_EQ(regions[0].class_name, "pot");
  EXPECT_EQ(regions[0].score, 0.9);
  EXPECT_EQ(regions[1].class_name, "toy");
  EXPECT_EQ(regions[1].score, 0.75);
  EXPECT_EQ(regions[2].class_name, "pot");
  EXPECT_EQ(regions[2].score, std::nullopt);
  EXPECT_NE(regions[0].id, regions[2].id) << "two pots";
  // As parts of one object.
  const FeaturesOfMasks of_one = import(SameName::kOne);
  ASSERT_EQ(of_one.at("cam/0001.png").regions.size(), 2u);
  EXPECT_EQ(of_one.at("cam/0001.png").regions[0].score, 0.9);
  // What it wrote is masks, with what tells of them.
  WriteFile(temp / "out/x.npy", "no mask");
  FeaturesOfMasks with_embeddings = of_one;
  with_embeddings.at("cam/0001.png").embeddings = "x.npy";
  WriteRegionFeatures(temp / "out", with_embeddings);
  EXPECT_EQ(RecognizeMasks(temp / "out", names).format, MaskFormat::kIdPngs);
  // An import without classes takes it away.
  fs::remove_all(temp / "masks");
  WriteFile(temp / "masks/a.json", CocoText(scene, Shape::kPolygons));
  ImportMasks(RecognizeMasks(temp / "masks", names),
              temp / "photos",
              names,
              SameName::kObjects,
              temp / "out");
  EXPECT_TRUE(FindRegionFeatures(temp / "out").empty());
}

}  // namespace
}  // namespace semfoam
