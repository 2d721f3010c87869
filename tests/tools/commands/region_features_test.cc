// SPDX-License-Identifier: GPL-3.0-or-later
//
// From embeddings beside masks to objects that are found by them: whole runs on the tabletop scene,
// with vectors as an encoder would make them.
#include "plugin/mask_import/region_features.h"

#include "foam/model/model.h"
#include "foam/util/random.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask_import/npy_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/plugin/mask_import/npy_bytes.h"
#include "tests/tools/exports.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

constexpr int kDimension = 64;
using Embedding = std::array<float, kDimension>;

// The direction of an object, of unit length; those of two objects are almost perpendicular.
Embedding DirectionOf(uint32_t id) {
  CounterRandom random(7, 0xe3b, id);
  Embedding direction;
  float squares = 0;
  for (float& x : direction) {
    x = static_cast<float>(random.Normal());
    squares += x * x;
  }
  for (float& x : direction) x /= std::sqrt(squares);
  return direction;
}

// The tabletop scene, and for each region the direction of its object with noise as long as that.
// Objects 6 to 13 stand on the others. Ids above 13 are the tracker's errors.
class TabletopFeatures : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    CopyTabletop(Workspace());
    const fs::path masks = Workspace() / "object_mask";
    FeaturesOfMasks features;
    for (const fs::directory_entry& entry : fs::directory_iterator(masks)) {
      const MaskPng mask = ReadMaskPng(entry.path());
      MaskFeatures& of_mask = features[entry.path().filename().string()];
      std::vector<float> rows;
      for (const uint32_t id : std::set<uint32_t>(mask.values.begin(), mask.values.end())) {
        if (id == 0) continue;
        of_mask.regions.push_back({MaskId{id}, id < 6 ? "room" : "thing", 0.75});
        CounterRandom random(8, 0xe3c, std::stoull(entry.path().stem().string()) * 1000 + id);
        for (const float x : DirectionOf(id)) {
          rows.push_back(x + static_cast<float>(random.Normal() / std::sqrt(kDimension)));
        }
      }
      of_mask.embeddings = entry.path().stem().string() + ".npy";
      const std::string shape =
          std::to_string(of_mask.regions.size()) + ", " + std::to_string(kDimension);
      WriteFile(masks / of_mask.embeddings, NpyBytes("<f4", shape, BytesOf(rows)));
    }
    WriteRegionFeatures(masks, features);
  }
  static void TearDownTestSuite() { delete folder_; }

  static fs::path Workspace() { return *folder_ / "workspace"; }

  static Outcome Segment(const fs::path& output, const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"automatic_segmenter",
                                          "--workspace_path",
                                          Workspace().string(),
                                          "--output_path",
                                          output.string(),
                                          "--test_every",
                                          "8",
                                          "--report",
                                          "0",
                                          "--formats",
                                          "ply"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunSemfoam(TinyTraining(arguments));
  }

  static TempFolder* folder_;
};

TempFolder* TabletopFeatures::folder_ = nullptr;

TEST_F(TabletopFeatures, FindTheObjects) {
  const fs::path out = *folder_ / "out";
  const Outcome outcome = Segment(out, {});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectAllListed(
      out,
      {"scene.foam", "effects.json", "training_log.csv", "training_plot.svg", "training_plot.png"});
  const json labels = LabelsIn(out);
  EXPECT_EQ(labels["files"]["npy"], "label_embeddings.npy");
  const fs::path file = out / "label_embeddings.npy";
  const NpyArray array = ParseNpy(file, ReadFile(file), NpyElements::kRealNumbers);
  ASSERT_EQ(array.shape.size(), 2u);
  EXPECT_EQ(array.shape[1], kDimension);
  int num_found = 0;
  for (const json& object : labels["objects"]) {
    const auto id = object["id"].get<uint32_t>();
    ASSERT_EQ(object["embedding"]["file"], "label_embeddings.npy");
    const auto row = object["embedding"]["row"].get<int64_t>();
    ASSERT_LT(row, array.shape[0]);
    double squares = 0;
    for (int i = 0; i < kDimension; ++i) squares += std::pow(array.RealAt(row * kDimension + i), 2);
    EXPECT_NEAR(squares, 1, 1e-5);
    EXPECT_EQ(object["class"], id < 6 ? "room" : "thing") << object["name"];
    EXPECT_GT(object["score"].get<double>(), 0.5) << object["name"];
    EXPECT_LE(object["score"].get<double>(), 0.75 + 1e-12) << object["name"];
    if (id > 13) continue;
    // The nearest of all true directions.
    std::map<double, uint32_t> by_cosine;
    for (uint32_t other = 1; other <= 13; ++other) {
      double cosine = 0;
      const Embedding direction = DirectionOf(other);
      for (int i = 0; i < kDimension; ++i) {
        cosine += direction[i] * array.RealAt(row * kDimension + i);
      }
      by_cosine.emplace(cosine, other);
    }
    EXPECT_EQ(by_cosine.rbegin()->second, id) << object["name"];
    EXPECT_GT(by_cosine.rbegin()->first, 0.8) << object["name"];
    ++num_found;
  }
  EXPECT_GE(num_found, 10);

  // Exporters take classes, and write labels.json and the embeddings again.
  const Outcome exported =
      RunExporter("mesh_exporter", out / "scene.foam", *folder_ / "things", {"--labels", "room"});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  for (const json& object : LabelsIn(*folder_ / "things")["objects"]) {
    EXPECT_EQ(!object["files"].empty(), object["class"] == "room") << object["name"];
  }
  EXPECT_EQ(ReadFile(*folder_ / "things" / "label_embeddings.npy"), ReadFile(file));
  const Outcome json_out =
      RunSemfoam({"foam_analyzer", "--foam_path", (out / "scene.foam").string(), "--json", "1"});
  EXPECT_EQ(json::parse(json_out.out)["objects"][0]["class"], labels["objects"][0]["class"]);
}

TEST_F(TabletopFeatures, GiveTheSameBytesOnAnyNumberOfThreads) {
  std::string foam, embeddings;
  for (const char* threads : {"1", "2", "5"}) {
    const fs::path out = *folder_ / threads;
    const Outcome outcome = Segment(
        out, {"--num_threads", threads, "--FoamTraining.num_rays", "60000", "--labels", "room"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    if (foam.empty()) foam = ReadFile(out / "scene.foam");
    if (embeddings.empty()) embeddings = ReadFile(out / "label_embeddings.npy");
    EXPECT_TRUE(ReadFile(out / "scene.foam") == foam) << threads;
    EXPECT_TRUE(ReadFile(out / "label_embeddings.npy") == embeddings) << threads;
  }
}

TEST_F(TabletopFeatures, ClassesAreKnownBeforeTheTraining) {
  const fs::path out = *folder_ / "none";
  ExpectRefused(Segment(out, {"--labels", "thin"}),
                {"", {"'thin'", "is 'thing' meant"}, "no id and no name"});
  EXPECT_THAT(FilesBelow(out), testing::IsEmpty());
}

TEST_F(TabletopFeatures, ThatAreDamagedEndTheRunBeforeTheTraining) {
  const fs::path npy = Workspace() / "object_mask/0009.npy";
  const std::string good = ReadFile(npy);
  WriteFile(npy, good.substr(0, good.size() - 4));
  const fs::path out = *folder_ / "damaged";
  const Outcome outcome = Segment(out, {});
  WriteFile(npy, good);
  ExpectRefused(outcome, {"0009.npy", {}, "its header promises"});
  EXPECT_THAT(FilesBelow(out), testing::IsEmpty());
}

}  // namespace
}  // namespace semfoam
