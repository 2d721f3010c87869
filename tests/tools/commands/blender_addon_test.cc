// SPDX-License-Identifier: GPL-3.0-or-later
//
// Blender, where it is installed, installs our add-on from its zip and imports a result of
// automatic_segmenter: names, counts, places, labels, cameras and points are those of its files.
// The picture that it renders is kept beside the test program, to be looked at.
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <cmath>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

// Runs the jobs of blender_addon.py, and returns its report.
json RunBlender(const TempFolder& folder, const json& jobs) {
  WriteFile(folder / "jobs.json", jobs.dump());
  const Outcome outcome = RunProgram("env",
                                     {"BLENDER_USER_SCRIPTS=" + (folder / "scripts").string(),
                                      "BLENDER_USER_CONFIG=" + (folder / "config").string(),
                                      "blender",
                                      "--background",
                                      "--factory-startup",
                                      "--python-exit-code",
                                      "1",
                                      "--python",
                                      SEMFOAM_TEST_SOURCE "/tools/commands/blender_addon.py",
                                      "--",
                                      SEMFOAM_BLENDER_ADDON,
                                      (folder / "jobs.json").string(),
                                      (folder / "report.json").string()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  return outcome.exit_code == 0 ? json::parse(ReadFile(folder / "report.json")) : json();
}

Eigen::Vector3d VectorOf(const json& numbers) {
  return {numbers[0].get<double>(), numbers[1].get<double>(), numbers[2].get<double>()};
}

Eigen::Vector3d PlaceOf(const json& thing) {
  const json& matrix = thing["matrix"];
  return {matrix[0][3].get<double>(), matrix[1][3].get<double>(), matrix[2][3].get<double>()};
}

// Expects the object of Blender that shows an entry of `objects` in labels.json.
void ExpectObject(const json& thing, const json& entry, const fs::path& result) {
  SCOPED_TRACE(entry["name"]);
  const PolygonMesh file = ReadPolygonMesh(result / entry["files"]["ply"].get<std::string>());
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : file.vertices) box.extend(vertex);
  EXPECT_EQ(thing["vertices"], file.vertices.size());
  EXPECT_EQ(thing["faces"], file.NumFaces());
  EXPECT_LT((VectorOf(thing["extent"][0]) - box.min()).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((VectorOf(thing["extent"][1]) - box.max()).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_EQ(thing["collection"], "Objects");
  EXPECT_FALSE(thing["hidden"]);
  EXPECT_EQ(thing["materials"], json::array({entry["name"]}));
  EXPECT_EQ(thing["labels"], json::array({entry["id"]}));
  EXPECT_TRUE(thing["slots_fit"]);
  EXPECT_EQ(thing["attributes"]["label"], "FACE");
  EXPECT_EQ(thing["attributes"]["photo_color"], "POINT");
  EXPECT_EQ(thing["attributes"]["confidence"], "POINT");
  EXPECT_EQ(thing["properties"]["label"], entry["id"]);
  for (const char* key : {"volume", "area", "confidence"}) {
    EXPECT_DOUBLE_EQ(thing["properties"][key], entry[key]) << key;
  }
}

void ExpectVolume(const json& thing, const json& entry) {
  SCOPED_TRACE(entry["name"]);
  EXPECT_EQ(thing["type"], "VOLUME");
  EXPECT_EQ(thing["parent"], entry["name"]);
  EXPECT_LT(PlaceOf(thing).norm(), 1e-5);
  EXPECT_TRUE(thing["hidden"]) << "the meshes are shown";
  EXPECT_THAT(thing["grids"],
              testing::ElementsAre("color", "confidence", "density", "label", "surface"));
  EXPECT_EQ(thing["materials"].size(), 1u);
}

void ExpectCameras(const json& things, const std::vector<PhotoRecord>& photos) {
  for (const PhotoRecord& photo : photos) {
    SCOPED_TRACE(photo.name);
    ASSERT_TRUE(things.contains(photo.name));
    const json& camera = things[photo.name];
    EXPECT_EQ(camera["type"], "CAMERA");
    EXPECT_EQ(camera["backgrounds"], json::array({{320, 240}}));
    EXPECT_NEAR(camera["lens"], 36 * photo.camera_params[0] / photo.width, 1e-4);
    const Eigen::Matrix3d turn = photo.cam_from_world_rotation.inverse().toRotationMatrix();
    EXPECT_LT((PlaceOf(camera) + turn * photo.cam_from_world_translation).norm(), 1e-5);
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(camera["matrix"][row][2], -turn(row, 2), 1e-5) << "it looks along -z";
    }
  }
}

TEST(BlenderAddon, ImportsAResultFolder) {
  const Outcome version = RunProgram("blender", {"--version"});
  if (version.exit_code == 127) GTEST_SKIP() << "blender is not installed";
  const TempFolder folder;
  CopyTabletop(folder / "w");
  const fs::path result = folder / "w/out";
  const Outcome run = RunSemfoam(TinyTraining({"automatic_segmenter",
                                               "--workspace_path",
                                               (folder / "w").string(),
                                               "--output_path",
                                               result.string(),
                                               "--report",
                                               "0",
                                               "--formats",
                                               "vdb,ply,glb",
                                               "--VolumeExport.max_resolution",
                                               "48"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const fs::path text_model = folder / "text model";
  fs::create_directories(text_model);
  ASSERT_EQ(RunProgram("colmap",
                       {"model_converter",
                        "--input_path",
                        (folder / "w/sparse/0").string(),
                        "--output_path",
                        text_model.string(),
                        "--output_type",
                        "TXT"})
                .exit_code,
            0);
  json labels = json::parse(ReadFile(result / "labels.json"));
  ASSERT_GT(labels["objects"].size(), 3u);

  // The same without what the first import takes: .glb, the model's photos, its text.
  const fs::path poor = folder / "poor";
  fs::copy(result, poor, fs::copy_options::recursive);
  fs::remove(poor / "scene.foam");
  for (const json& entry : labels["objects"]) {
    fs::remove(poor / entry["files"]["ply"].get<std::string>());
  }
  // Damaged ones.
  const fs::path cut = folder / "cut";
  fs::copy(result, cut, fs::copy_options::recursive);
  const fs::path cut_ply = cut / labels["objects"][0]["files"]["ply"].get<std::string>();
  fs::resize_file(cut_ply, fs::file_size(cut_ply) / 2);
  const fs::path garbled = folder / "garbled";
  fs::create_directories(garbled);
  WriteFile(garbled / "labels.json", "{\"labels\": 7}");
  const fs::path bad_foam = folder / "bad_foam";
  fs::copy(result, bad_foam, fs::copy_options::recursive);
  WriteFile(bad_foam / "scene.foam", "not a foam, but long enough to have a header");

  const fs::path picture = fs::current_path() / "blender_addon_test.png";
  fs::remove(picture);
  const json report = RunBlender(
      folder,
      {{{"options", {{"filepath", (result / "labels.json").string()}}},
        {"picture", picture.string()}},
       {{"options",
         {{"filepath", (poor / "labels.json").string()},
          {"model_path", text_model.string()},
          {"image_path", (folder / "w/images").string()},
          {"upright", "LEVEL"},
          {"shading", "LIT"},
          {"show", "VOLUMES"}}}},
       {{"options", {{"filepath", (cut / "labels.json").string()}}}},
       {{"options", {{"filepath", (garbled / "labels.json").string()}}}},
       {{"options", {{"filepath", (bad_foam / "scene.foam").string()}}}},
       {{"options", {{"filepath", (folder / "nowhere/labels.json").string()}}}},
       {{"options",
         {{"filepath", (result / "labels.json").string()}, {"model_path", garbled.string()}}}}});
  ASSERT_FALSE(report.is_null());
  EXPECT_EQ(report["version"], SEMFOAM_VERSION);

  const json& things = report["jobs"][0]["objects"];
  for (const json& entry : labels["objects"]) {
    const std::string name = entry["name"];
    ASSERT_TRUE(things.contains(name) && things.contains(name + " volume")) << name;
    ExpectObject(things[name], entry, result);
    ExpectVolume(things[name + " volume"], entry);
  }
  ExpectCameras(things, ReadModel(result / "scene.foam").photos);
  const size_t points = ReadReconstruction(folder / "w/sparse/0").points.size();
  EXPECT_EQ(things["SfM points"]["vertices"], points);
  EXPECT_GT(fs::file_size(picture), 10000u) << picture;
  // 0.5 where nothing is lit.
  EXPECT_LT(report["jobs"][0]["difference"], 0.12);

  const json& poor_things = report["jobs"][1]["objects"];
  EXPECT_EQ(poor_things["SfM points"]["vertices"], points);
  EXPECT_LT(poor_things["Semantic Foam"]["properties"]["tilt_degrees"], 0.01);
  for (const json& entry : labels["objects"]) {
    const std::string name = entry["name"];
    ASSERT_TRUE(poor_things.contains(name)) << name;
    // glTF has a vertex twice where the texture has a seam.
    EXPECT_GE(poor_things[name]["vertices"], things[name]["vertices"]);
    EXPECT_EQ(poor_things[name]["faces"], things[name]["faces"]);
    EXPECT_TRUE(poor_things[name]["hidden"]);
    EXPECT_FALSE(poor_things[name + " volume"]["hidden"]);
  }
  EXPECT_EQ(poor_things["0000.jpg"]["backgrounds"].size(), 1u);

  const std::pair<size_t, std::vector<std::string>> refused[] = {
      {2, {cut_ply.filename().string(), "is damaged"}},
      {3, {"labels.json", "is no labels.json"}},
      {4, {"scene.foam", "is no scene.foam"}},
      {5, {"nowhere/labels.json", "does not exist"}},
      {6, {"garbled", "choose the folder of a COLMAP model"}}};
  for (const auto& [job, phrases] : refused) {
    ASSERT_TRUE(report["jobs"][job].contains("error")) << job;
    for (const std::string& phrase : phrases) {
      EXPECT_THAT(report["jobs"][job]["error"].get<std::string>(), HasSubstr(phrase));
    }
    EXPECT_EQ(report["jobs"][job]["left"], 0) << "nothing is imported in part";
  }
}

}  // namespace
}  // namespace semfoam
