// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/label_sidecar.h"

#include "foam/util/error.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::json;

class LabelSidecar : public TemporaryFolderTest {};

TEST_F(LabelSidecar, SaysEverythingOfEveryObject) {
  Model model = TouchingBalls(1000);
  model.world_from_normalized = {2, {5e5, 4.5e6, 0.1}};
  model.labels[1].name = "M\xC3\xBCtze \"blue\"";
  ExportableScene scene = MakeExportableScene(model);
  scene.objects[0].photos = {{"b.jpg", 300}, {"a/c.jpg", 20}};
  scene.objects[1].left_out = {2, 5, 0.25, 4, 0.125, {1, 2, 3}};
  const auto path = folder_ / "labels.json";
  WriteLabelSidecar(path,
                    scene,
                    {{kNoObject, "vdb", "scene.vdb", ""},
                     {LabelId{7}, "ply", "objects/7_mug.ply", ""},
                     {LabelId{7}, "vdb", "objects/7_mug.vdb", ""}});
  const json sidecar = json::parse(std::ifstream(path));
  EXPECT_EQ(sidecar["version"], 1);
  EXPECT_EQ(sidecar["labels"], (json{{"7", "mug"}, {"8", "M\xC3\xBCtze \"blue\""}}));
  EXPECT_FALSE(sidecar.contains("source_ids"));
  ASSERT_EQ(sidecar["objects"].size(), 2u);
  for (size_t k = 0; k < 2; ++k) {
    const json& object = sidecar["objects"][k];
    const ObjectInfo& info = scene.objects[k];
    EXPECT_EQ(object["id"], info.id);
    EXPECT_EQ(object["name"], info.name);
    EXPECT_EQ(object["color"], json(info.color));
    EXPECT_EQ(object["cells"], info.cells.size());
    EXPECT_EQ(object["pieces"], info.components);
    EXPECT_EQ(object["cavities"], info.cavities);
    EXPECT_EQ(object["genus"], info.genus);
    EXPECT_EQ(object["area"].get<double>(), info.area);
    EXPECT_EQ(object["volume"].get<double>(), info.volume) << "doubles survive";
    EXPECT_EQ(object["confidence"].get<double>(), info.confidence);
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(object["centroid"][a].get<double>(), info.centroid[a]);
      EXPECT_EQ(object["bounding_box"][0][a].get<double>(), info.bounding_box.min()[a]);
      EXPECT_EQ(object["bounding_box"][1][a].get<double>(), info.bounding_box.max()[a]);
    }
  }
  EXPECT_EQ(sidecar["objects"][0]["files"],
            (json{{"ply", "objects/7_mug.ply"}, {"vdb", "objects/7_mug.vdb"}}));
  EXPECT_EQ(sidecar["objects"][1]["files"], json::object());
  EXPECT_EQ(sidecar["files"], (json{{"vdb", "scene.vdb"}}));
  EXPECT_EQ(sidecar["frame"], json::parse(ExportTransformJson({})));
  EXPECT_EQ(sidecar["objects"][0]["photos"], (json{{"b.jpg", 300}, {"a/c.jpg", 20}}));
  const std::string text{std::istreambuf_iterator<char>(std::ifstream(path).rdbuf()), {}};
  EXPECT_LT(text.find("b.jpg"), text.find("a/c.jpg")) << "by pixels";
  EXPECT_EQ(sidecar["objects"][1]["photos"], json::object());
  EXPECT_EQ(sidecar["objects"][0]["left_out"],
            (json{{"pieces", 0}, {"cells", 0}, {"volume", 0.0}}));
  EXPECT_EQ(sidecar["objects"][1]["left_out"],
            (json{{"pieces", 2},
                  {"cells", 5},
                  {"volume", 0.25},
                  {"largest", {{"cells", 4}, {"volume", 0.125}, {"center", {1.0, 2.0, 3.0}}}}}));
  EXPECT_FALSE(sidecar.contains("labels_left_out"));
  EXPECT_FALSE(sidecar.contains("source_model_xxh64"));
}

TEST_F(LabelSidecar, SaysOfWhichModelTheFilesAre) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(200));
  WriteLabelSidecar(folder_ / "labels.json", scene, {}, "0123456789abcdef");
  const json sidecar = json::parse(std::ifstream(folder_ / "labels.json"));
  EXPECT_EQ(sidecar["source_model_xxh64"], "0123456789abcdef");
}

TEST_F(LabelSidecar, HoldsClassesScoresAndEmbeddings) {
  Model model = TouchingBalls(200);
  model.labels[0].features = {"cup", 0.75, {}};
  model.labels[1].features = {"", {}, {0.6f, 0.8f, 0}};
  WriteLabelSidecar(folder_ / "labels.json", MakeExportableScene(model), {});
  const json objects = json::parse(std::ifstream(folder_ / "labels.json"))["objects"];
  EXPECT_EQ(objects[0]["class"], "cup");
  EXPECT_EQ(objects[0]["score"], 0.75);
  EXPECT_FALSE(objects[0].contains("embedding"));
  EXPECT_FALSE(objects[1].contains("class"));
  EXPECT_FALSE(objects[1].contains("score"));
  EXPECT_EQ(objects[1]["embedding"], (json{{"file", "label_embeddings.npy"}, {"row", 0}}));
  const std::string npy{
      std::istreambuf_iterator<char>(std::ifstream(folder_ / "label_embeddings.npy").rdbuf()), {}};
  ASSERT_EQ(npy.size(), 128 + 3 * sizeof(float));
  EXPECT_EQ(npy.substr(0, 10), std::string("\x93NUMPY\x01\x00\x76\x00", 10));
  EXPECT_EQ(npy.substr(10, 60), "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), } ");
  EXPECT_EQ(npy[127], '\n');
  float row[3];
  std::memcpy(row, npy.data() + 128, sizeof(row));
  EXPECT_THAT(row, testing::ElementsAre(0.6f, 0.8f, 0));
}

TEST_F(LabelSidecar, NamesTheLabelsThatLostAllTheirComponents) {
  ExportableSceneOptions options;
  options.components.min_cells = 1000;
  const ExportableScene scene = MakeExportableScene(TouchingBalls(1000), options);
  WriteLabelSidecar(folder_ / "labels.json", scene, {});
  const json sidecar = json::parse(std::ifstream(folder_ / "labels.json"));
  EXPECT_EQ(sidecar["objects"], json::array());
  ASSERT_EQ(sidecar["labels_left_out"].size(), 2u);
  EXPECT_EQ(sidecar["labels_left_out"][0]["id"], 7);
  EXPECT_EQ(sidecar["labels_left_out"][0]["name"], "mug");
  EXPECT_EQ(sidecar["labels_left_out"][0]["left_out"]["cells"],
            scene.labels_left_out[0].left_out.cells);
  EXPECT_GT(scene.labels_left_out[0].left_out.cells, 0);
  EXPECT_EQ(sidecar["labels_left_out"][0]["reason"], "too few cells in every piece");
}

TEST_F(LabelSidecar, HoldsFragmentsAsOneEntry) {
  ExportableScene scene = MakeExportableScene(TouchingBalls(1000));
  WriteLabelSidecar(folder_ / "labels.json", scene, {});
  EXPECT_FALSE(json::parse(std::ifstream(folder_ / "labels.json")).contains("leftovers"));
  LeftOutLabel fragment{LabelId{218}, "label_218", {2, 5, 0.25, 4, 0.125, {1, 2, 3}}, "why", true};
  scene.labels_left_out.push_back(fragment);
  fragment.id = LabelId{40};
  scene.labels_left_out.push_back(fragment);
  fragment.id = LabelId{41};
  fragment.is_fragment = false;
  scene.labels_left_out.push_back(fragment);
  WriteLabelSidecar(folder_ / "labels.json", scene, {});
  const json leftovers = json::parse(std::ifstream(folder_ / "labels.json"))["leftovers"];
  EXPECT_EQ(leftovers["ids"], (json{218, 40}));
  EXPECT_EQ(leftovers["cells"], 10);
  EXPECT_EQ(leftovers["volume"], 0.5);
  EXPECT_EQ(leftovers["below_share_of_cells"], 0.001);
  EXPECT_EQ(leftovers["below_share_of_confidence"], 0.85);
}

TEST_F(LabelSidecar, SaysTheFrame) {
  ExportTransformOptions frame;
  frame.transform = "0 -1 0 5 1 0 0 0 0 0 1 0";
  frame.units = LengthUnit::kMillimeter;
  ExportableSceneOptions options;
  options.transform = ParseExportTransform(frame);
  WriteLabelSidecar(folder_ / "labels.json", MakeExportableScene(TouchingBalls(200), options), {});
  const json sidecar = json::parse(std::ifstream(folder_ / "labels.json"));
  EXPECT_EQ(sidecar["frame"], json::parse(ExportTransformJson(options.transform)));
}

TEST_F(LabelSidecar, KeepsLabelsWithoutObjectsAndTheMasksOwnIds) {
  Model model = TouchingBalls(200);
  model.foam.raw_density.assign(200, -10.f);
  model.labels[1].source_id = MaskId{8'421'504};
  const ExportableScene scene = MakeExportableScene(model);
  WriteLabelSidecar(folder_ / "labels.json", scene, {});
  const json sidecar = json::parse(std::ifstream(folder_ / "labels.json"));
  EXPECT_EQ(sidecar["labels"], (json{{"7", "mug"}, {"8", "label_8"}}));
  EXPECT_EQ(sidecar["source_ids"], (json{{"8", 8'421'504}}));
  EXPECT_EQ(sidecar["objects"], json::array());
}

TEST_F(LabelSidecar, WithoutLabelsItIsStillASidecar) {
  EXPECT_EQ(json::parse(LabelTableJson({})), (json{{"version", 1}, {"labels", json::object()}}));
}

TEST_F(LabelSidecar, IdsStandInTheOrderOfTheTableAndZeroIsNoLabel) {
  EXPECT_EQ(LabelTableJson({{LabelId{0}, MaskId{0}, ""},
                            {LabelId{2}, MaskId{2}, "b"},
                            {LabelId{10}, MaskId{10}, "a"}}),
            R"({"version":1,"labels":{"2":"b","10":"a"}})");
}

TEST_F(LabelSidecar, BytesThatAreNoTextDoNotStopIt) {
  const json table = json::parse(LabelTableJson({{LabelId{3},
                                                  MaskId{3},
                                                  "a\xFF"
                                                  "b"}}));
  EXPECT_EQ(table["labels"]["3"],
            "a\xEF\xBF\xBD"
            "b");
}

TEST_F(LabelSidecar, AnUnwritablePlaceIsAUserError) {
  std::ofstream(folder_ / "file") << "x";
  const ExportableScene scene = MakeExportableScene(TouchingBalls(100));
  EXPECT_THROW(WriteLabelSidecar(folder_ / "file" / "labels.json", scene, {}), UserError);
}

}  // namespace
}  // namespace semfoam
