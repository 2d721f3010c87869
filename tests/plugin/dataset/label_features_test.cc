// SPDX-License-Identifier: GPL-3.0-or-later
//
// Features of regions, averaged over the objects that they are of.
#include "plugin/dataset/label_features.h"

#include "foam/util/parallel.h"
#include "plugin/dataset/scene_checksums.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/dataset/training_scene.h"

#include <cmath>

#include "tests/mistake.h"
#include "tests/plugin/dataset/small_workspace.h"
#include "tests/plugin/mask_import/npy_bytes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::FloatEq;
using testing::IsEmpty;

RegionFeatures Region(const std::string& class_name, std::optional<double> score) {
  return {MaskId{1}, class_name, score};
}

TEST(LabelFeatureMean, CountsRegionsByTheirPixels) {
  LabelFeatureMean mean;
  EXPECT_EQ(mean.Mean(), LabelFeatures{});
  mean.Add(100, Region("mug", 0.5), {});
  mean.Add(300, Region("cup", 0.25), {});
  mean.Add(200, Region("mug", 0.75), {});
  // 200 of 600 pixels for "mug", 75 for "cup".
  EXPECT_EQ(mean.Mean().class_name, "mug");
  EXPECT_DOUBLE_EQ(*mean.Mean().score, 200.0 / 600);
  // A region without a score is sure, one without a class says nothing of classes.
  mean.Add(400, Region("cup", {}), {});
  mean.Add(5000, Region("", 0.125), {});
  EXPECT_EQ(mean.Mean().class_name, "cup");
  EXPECT_DOUBLE_EQ(*mean.Mean().score, 475.0 / 1000);
  EXPECT_THAT(mean.Mean().embedding, IsEmpty());
}

TEST(LabelFeatureMean, TakesTheFirstOfEquallyGoodClasses) {
  LabelFeatureMean mean;
  mean.Add(10, Region("b", 0.5), {});
  mean.Add(10, Region("a", 0.5), {});
  EXPECT_EQ(mean.Mean().class_name, "a");
  EXPECT_DOUBLE_EQ(*mean.Mean().score, 0.25);
}

TEST(LabelFeatureMean, AveragesScoresWithoutAClass) {
  LabelFeatureMean mean;
  mean.Add(10, Region("", 0.5), {});
  mean.Add(30, Region("", 0.75), {});
  mean.Add(60, Region("", {}), {});
  EXPECT_EQ(mean.Mean().class_name, "");
  EXPECT_DOUBLE_EQ(*mean.Mean().score, 27.5 / 40);
}

TEST(LabelFeatureMean, AveragesDirections) {
  LabelFeatureMean mean;
  // 3 * (1, 0) and 4 * (0, 1), whatever their lengths.
  mean.Add(3, Region("", {}), std::vector<float>{250, 0});
  mean.Add(7, Region("", {}), {});
  mean.Add(4, Region("", {}), std::vector<float>{0, 0.001f});
  EXPECT_THAT(mean.Mean().embedding, ElementsAre(FloatEq(0.6f), FloatEq(0.8f)));
  EXPECT_EQ(mean.Mean().score, std::nullopt);
  // What cancels has no direction.
  mean.Add(3, Region("", {}), std::vector<float>{-1, 0});
  mean.Add(4, Region("", {}), std::vector<float>{0, -2});
  EXPECT_THAT(mean.Mean().embedding, IsEmpty());
}

// SmallWorkspace's masks have six ids, 10 to 15, a row of seven pixels each.
class SceneFeatures : public testing::Test {
 protected:
  fs::path Masks() const { return workspace_.temp / "object_mask"; }
  fs::path File() const { return Masks() / "region_features.json"; }

  std::vector<Label> Load(const SceneOptions& options) {
    const TrainingScene scene(PlanScene(options));
    warnings_ = scene.Warnings();
    return scene.Labels();
  }
  std::vector<Label> Load() { return Load(workspace_.Options()); }

  SmallWorkspace workspace_;
  std::vector<std::string> warnings_;
};

TEST_F(SceneFeatures, AreThoseOfTheObjectsPixels) {
  WriteFile(File(), R"({"masks": {
    "a.png": {"regions": [{"id": 10, "class": "mug", "score": 0.5}, {"id": 12}],
              "embeddings": "a.npy"},
    "sub/c.png": {"regions": [{"id": 12, "score": 0.75}, {"id": 10, "class": "cup", "score": 0.75}],
                  "embeddings": "sub/c.npy"}}})");
  WriteFile(Masks() / "a.npy", NpyBytes("<f4", "2, 2", BytesOf<float>({3, 0, 5, 12})));
  WriteFile(Masks() / "sub/c.npy", NpyBytes("<f8", "2, 2", BytesOf<double>({5, 12, 0, 1e-3})));
  const std::vector<Label> labels = Load();
  ASSERT_EQ(labels.size(), 6u);
  EXPECT_THAT(warnings_, IsEmpty());
  EXPECT_EQ(labels[0].features.class_name, "cup");
  EXPECT_EQ(labels[0].features.score, 0.375);
  const auto half = static_cast<float>(std::sqrt(0.5));
  EXPECT_THAT(labels[0].features.embedding, ElementsAre(FloatEq(half), FloatEq(half)));
  EXPECT_EQ(labels[2].features.class_name, "");
  EXPECT_EQ(labels[2].features.score, 0.75);
  EXPECT_THAT(labels[2].features.embedding, ElementsAre(FloatEq(5 / 13.f), FloatEq(12 / 13.f)));
  for (const int other : {1, 3, 4, 5}) EXPECT_EQ(labels[other].features, LabelFeatures{});
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const std::vector<Label> again = Load();
    for (size_t k = 0; k < labels.size(); ++k) EXPECT_EQ(again[k].features, labels[k].features);
  }
}

TEST_F(SceneFeatures, OfHeldOutPhotosDoNotCount) {
  WriteFile(File(), R"({"masks": {
    "a.png": {"regions": [{"id": 10, "class": "mug"}]},
    "b.png": {"regions": [{"id": 10, "class": "cup"}]}}})");
  SceneOptions options = workspace_.Options();
  options.test_every = 3;  // a.png
  EXPECT_EQ(Load(options)[0].features.class_name, "cup");
  EXPECT_EQ(Load()[0].features.class_name, "cup") << "the first of equally good ones";
}

TEST_F(SceneFeatures, OfNothingAreWarnedOf) {
  WriteFile(File(), R"({"masks": {
    "a.png": {"regions": [{"id": 10, "class": "mug"}, {"id": 99, "class": "ghost"}]},
    "d.png": {"regions": [{"id": 10, "class": "cup"}]}}})");
  EXPECT_EQ(Load()[0].features.class_name, "mug");
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_THAT(warnings_[0],
              NamesMistake(File().string(), {"1 mask", "d.png", "1 region"}, "no pixel"));
}

TEST_F(SceneFeatures, ThatAreWrongAreRefused) {
  const std::string both = R"({"masks": {
    "a.png": {"regions": [{"id": 10}], "embeddings": "a.npy"},
    "b.png": {"regions": [{"id": 11}], "embeddings": "b.npy"}}})";
  WriteFile(File(), both);
  WriteFile(Masks() / "a.npy", NpyBytes("<f4", "1, 2", BytesOf<float>({1, 2})));
  WriteFile(Masks() / "b.npy", NpyBytes("<f4", "1, 3", BytesOf<float>({1, 2, 3})));
  EXPECT_THAT(UserErrorOf([&] { Load(); }),
              NamesMistake((Masks() / "b.npy").string(), {"3", "a.npy", "2"}, "one encoder"));
  WriteFile(Masks() / "b.npy", NpyBytes("<f4", "2, 2", BytesOf<float>({1, 2, 3, 4})));
  EXPECT_THAT(UserErrorOf([&] { Load(); }),
              NamesMistake((Masks() / "b.npy").string(), {"2 x 2", "1"}, "a row for each region"));
  WriteFile(File(), both.substr(0, 40));
  EXPECT_THAT(UserErrorOf([&] { Load(); }),
              NamesMistake(File().string(), {"40"}, "before its JSON does"));
}

TEST_F(SceneFeatures, ArePartOfTheInput) {
  const auto checksum = [&] { return AllChecksumsOf(PlanScene(workspace_.Options())).masks; };
  const std::string without = checksum();
  WriteFile(File(), R"({"masks": {"a.png": {"regions": [{"id": 10}], "embeddings": "a.npy"}}})");
  WriteFile(Masks() / "a.npy", NpyBytes("<f4", "1, 2", BytesOf<float>({1, 2})));
  const std::string with = checksum();
  EXPECT_NE(with, without);
  WriteFile(Masks() / "a.npy", NpyBytes("<f4", "1, 2", BytesOf<float>({1, 3})));
  EXPECT_NE(checksum(), with);
  SceneOptions without_masks = workspace_.Options();
  without_masks.use_masks = false;
  EXPECT_TRUE(PlanScene(without_masks).features_file.empty());
}

}  // namespace
}  // namespace semfoam
