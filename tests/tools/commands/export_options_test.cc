// SPDX-License-Identifier: GPL-3.0-or-later
//
// The options of the exporters: which formats, and in which frame.
#include "foam/model/model.h"

#include <algorithm>
#include <functional>
#include <set>
#include <sstream>

#include "tests/export/io/read_glb.h"
#include "tests/export/io/read_usda.h"
#include "tests/export/test_foams.h"
#include "tests/tools/commands/read_obj.h"
#include "tests/tools/exports.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

class ExportOptionsTest : public testing::Test {
 protected:
  void SetUp() override {
    Model model = TouchingBalls(1500);
    model.world_from_normalized = {2, {10, 20, 30}};
    // The photos say that -y is up, as in most of COLMAP's frames.
    model.photos.resize(3);
    for (PhotoRecord& photo : model.photos) {
      photo.name = "a.jpg";
      photo.camera_model = "SIMPLE_PINHOLE";
      photo.width = photo.height = 10;
      photo.camera_params = {10, 5, 5};
    }
    WriteModel(folder_ / "scene.foam", model);
  }

  Outcome Run(const std::string& command,
              const std::string& out,
              const std::vector<std::string>& options = {}) {
    return RunExporter(command, folder_ / "scene.foam", folder_ / out, options);
  }

  json Labels(const std::string& out) { return LabelsIn(folder_ / out); }

  void ExpectListed(const std::string& out) { ExpectAllListed(folder_ / out); }

  TempFolder folder_;
};

TEST_F(ExportOptionsTest, FormatsAreThoseAskedFor) {
  ASSERT_EQ(Run("mesh_exporter", "some", {"--formats", "glb,ply"}).exit_code, 0);
  EXPECT_THAT(FilesBelow(folder_ / "some"),
              UnorderedElementsAre("labels.json",
                                   "scene.glb",
                                   "objects/7_mug.ply",
                                   "objects/7_mug.glb",
                                   "objects/8_label_8.ply",
                                   "objects/8_label_8.glb"));
  ExpectListed("some");
  // What comes later is added to the list.
  ASSERT_EQ(Run("volume_exporter",
                "some",
                {"--max_resolution",
                 "16",
                 "--VolumeExport.label_grid_type",
                 "both",
                 "--VolumeExport.points",
                 "1"})
                .exit_code,
            0);
  ExpectListed("some");
  ASSERT_EQ(Run("mesh_exporter", "some").exit_code, 0);
  ExpectListed("some");
  EXPECT_THAT(FilesBelow(folder_ / "some"), SizeIs(1 + 5 + 2 * 6));
  EXPECT_EQ(Labels("some")["files"]["vdb_labels_int32"], "scene_labels_int32.vdb");
  EXPECT_EQ(Labels("some")["files"]["vdb_points"], "scene_points.vdb");
}

TEST_F(ExportOptionsTest, TheStageNamesTheVolumesThatAreThere) {
  ASSERT_EQ(Run("mesh_exporter", "out", {"--formats", "usda"}).exit_code, 0);
  EXPECT_THAT(ReadFile(folder_ / "out/scene.usda"), testing::Not(HasSubstr(".vdb")));
  ASSERT_EQ(Run("volume_exporter", "out", {"--VolumeExport.max_resolution", "16"}).exit_code, 0);
  ASSERT_EQ(Run("mesh_exporter", "out", {"--formats", "usda"}).exit_code, 0);
  const json stage = UsdaReader::Read(folder_ / "out/scene.usda");
  for (const auto& [name, object] : stage["children"]["scene"]["children"].items()) {
    const std::string path =
        object["children"]["volume"]["children"]["density"]["properties"]["filePath"]["value"];
    EXPECT_TRUE(fs::exists(folder_ / "out" / path)) << path;
  }
}

std::vector<Eigen::Vector3d> UsdaVertices(const fs::path& path, const std::string& prim) {
  const json stage = UsdaReader::Read(path);
  const json& mesh =
      stage["children"]["scene"]["children"][prim]["children"]["surface"]["properties"];
  const json& t = mesh["xformOp:translate"]["value"];
  std::vector<Eigen::Vector3d> vertices;
  for (const json& p : mesh["points"]["value"]) {
    vertices.emplace_back(p[0], p[1], p[2]);
    vertices.back() += Eigen::Vector3d(t[0], t[1], t[2]);
  }
  return vertices;
}

TEST_F(ExportOptionsTest, TheMethodReachesEveryFormat) {
  const auto faces = [&](const std::string& out, const std::string& name) {
    const std::string text = ReadFile(folder_ / out / "objects" / (name + ".obj"));
    size_t count = 0;
    for (size_t at = 0; (at = text.find("\nf ", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  ASSERT_EQ(Run("mesh_exporter", "plain").exit_code, 0);
  ASSERT_EQ(Run("mesh_exporter", "cells", {"--method", "cells"}).exit_code, 0);
  const std::string glb = "objects/7_mug.glb";
  const Outcome smooth = Run("mesh_exporter", "smooth", {"--method", "smooth"});
  ASSERT_EQ(smooth.exit_code, 0) << smooth.err;
  EXPECT_THAT(smooth.err, HasSubstr(" faces, 1 shell, no cavities, genus 0, from the cells 0.0"));
  EXPECT_THAT(smooth.err, HasSubstr("Hausdorff distance 0."));
  EXPECT_TRUE(ReadFile(folder_ / "plain" / glb) == ReadFile(folder_ / "smooth" / glb));
  ExpectListed("smooth");
  const Outcome few = Run("mesh_exporter", "few", {"--MeshExport.target_faces", "100"});
  ASSERT_EQ(few.exit_code, 0) << few.err;
  for (const std::string name : {"7_mug", "8_label_8"}) {
    EXPECT_NE(faces("smooth", name), faces("cells", name));
    EXPECT_GT(faces("smooth", name), 200u);
    EXPECT_LE(faces("few", name), 100u);
    EXPECT_GE(faces("few", name), 99u);
  }
  // The same surface in all formats.
  const std::vector<Eigen::Vector3d> obj = ObjVertices(folder_ / "few/objects/7_mug.obj");
  const std::vector<Eigen::Vector3d> in_glb = ImportedVertices(ReadGlb(folder_ / "few" / glb));
  const std::vector<Eigen::Vector3d> in_usda = UsdaVertices(folder_ / "few/scene.usda", "mug");
  ASSERT_EQ(in_usda.size(), obj.size());
  EXPECT_EQ(in_glb.size(), obj.size());
  for (size_t v = 0; v < obj.size(); ++v) EXPECT_LT((in_usda[v] - obj[v]).norm(), 1e-5);
  const std::string ply = ReadFile(folder_ / "few/objects/7_mug.ply").substr(0, 300);
  EXPECT_THAT(ply, HasSubstr("element vertex " + std::to_string(obj.size()) + "\n"));
  // What cannot be is said: a torus has at least 14 faces.
  WriteModel(folder_ / "scene.foam", Torus());
  const Outcome too_few = Run("mesh_exporter", "too_few", {"--target_faces", "12"});
  ASSERT_EQ(too_few.exit_code, 0) << too_few.err;
  EXPECT_THAT(too_few.err, HasSubstr(" faces instead of 12, because fewer would"));
}

TEST_F(ExportOptionsTest, SmoothSurfacesAreTheSameOnAnyNumberOfThreads) {
  const auto run = [&](const std::string& threads) {
    const Outcome outcome =
        Run("mesh_exporter",
            threads,
            {"--method", "smooth", "--target_faces", "300", "--num_threads", threads});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  };
  const std::string log = run("1");
  for (const std::string threads : {"2", "5"}) {
    EXPECT_EQ(run(threads), log);
    for (const std::string& file : FilesBelow(folder_ / "1")) {
      EXPECT_EQ(ReadFile(folder_ / threads / file), ReadFile(folder_ / "1" / file)) << file;
    }
  }
}

std::vector<Eigen::Vector3d> VoxelCenters(const fs::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  std::vector<Eigen::Vector3d> centers;
  for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Vec3d center = grid->indexToWorld(voxel.getCoord());
    centers.emplace_back(center.x(), center.y(), center.z());
  }
  return centers;
}

// Every format of every object of `moved` is that of `plain`, each point sent through
// `expected`.
void ExpectMoved(const fs::path& plain,
                 const fs::path& moved,
                 const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& expected,
                 const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& file_from_imported) {
  const auto expect = [&](const std::vector<Eigen::Vector3d>& from,
                          const std::vector<Eigen::Vector3d>& to,
                          const std::string& what) {
    ASSERT_FALSE(from.empty()) << what;
    ASSERT_EQ(from.size(), to.size()) << what;
    double farthest = 0;
    for (size_t k = 0; k < from.size(); ++k) {
      farthest = std::max(farthest, (expected(from[k]) - to[k]).norm());
    }
    EXPECT_LT(farthest, 1e-4) << what;
  };
  const std::string obj = "objects/7_mug.obj", glb = "objects/7_mug.glb", vdb = "objects/7_mug.vdb";
  expect(ObjVertices(plain / obj), ObjVertices(moved / obj), obj);
  std::vector<Eigen::Vector3d> imported = ImportedVertices(ReadGlb(moved / glb));
  for (Eigen::Vector3d& x : imported) x = file_from_imported(x);
  expect(ImportedVertices(ReadGlb(plain / glb)), imported, glb);
  expect(UsdaVertices(plain / "scene.usda", "mug"),
         UsdaVertices(moved / "scene.usda", "mug"),
         "scene.usda");
  expect(VoxelCenters(plain / vdb), VoxelCenters(moved / vdb), vdb);

  const json from = json::parse(ReadFile(plain / "labels.json"))["objects"][0];
  const json to = json::parse(ReadFile(moved / "labels.json"))["objects"][0];
  const auto corner = [](const json& object, int which) {
    const json& c = object["bounding_box"][which];
    return Eigen::Vector3d(c[0], c[1], c[2]);
  };
  const Eigen::Vector3d a = expected(corner(from, 0)), b = expected(corner(from, 1));
  EXPECT_LT((corner(to, 0) - a.cwiseMin(b)).norm(), 1e-9);
  EXPECT_LT((corner(to, 1) - a.cwiseMax(b)).norm(), 1e-9);
}

TEST_F(ExportOptionsTest, AFrameReachesEveryFormatAlike) {
  const auto export_all = [&](const std::string& out, const std::vector<std::string>& frame) {
    std::vector<std::string> volume = {"--VolumeExport.max_resolution", "16"};
    volume.insert(volume.end(), frame.begin(), frame.end());
    const Outcome volumes = Run("volume_exporter", out, volume);
    ASSERT_EQ(volumes.exit_code, 0) << volumes.err;
    const Outcome meshes = Run("mesh_exporter", out, frame);
    ASSERT_EQ(meshes.exit_code, 0) << meshes.err;
  };
  export_all("plain", {});
  const auto same = [](const Eigen::Vector3d& x) { return x; };

  // The value begins with a minus, and no option is meant.
  export_all("moved", {"--transform", "-1 0 0 5 0 -1 0 6 0 0 1 7", "--scale", "100"});
  ExpectMoved(
      folder_ / "plain",
      folder_ / "moved",
      [](const auto& x) {
        return Eigen::Vector3d(100 * (5 - x.x()), 100 * (6 - x.y()), 100 * (x.z() + 7));
      },
      same);

  // The photos' -y comes up; glTF, y-up itself, is not turned again, and is in metres.
  export_all("y", {"--up_axis", "y", "--units", "cm"});
  ExpectMoved(
      folder_ / "plain",
      folder_ / "y",
      [](const auto& x) { return Eigen::Vector3d(x.x(), -x.y(), -x.z()); },
      [](const auto& x) { return Eigen::Vector3d(100 * x.x(), 100 * x.z(), -100 * x.y()); });
  export_all("z", {"--up_axis", "z"});
  ExpectMoved(
      folder_ / "plain",
      folder_ / "z",
      [](const auto& x) { return Eigen::Vector3d(x.x(), x.z(), -x.y()); },
      same);

  for (const char* out : {"plain", "moved", "y", "z"}) {
    const json frame = Labels(out)["frame"];
    EXPECT_EQ(ReadGlb(folder_ / out / "scene.glb").json["nodes"][0]["extras"]["frame"], frame);
    const json stage = UsdaReader::Read(folder_ / out / "scene.usda");
    EXPECT_EQ(json::parse(stage["metadata"]["customLayerData"]["frame"].get<std::string>()), frame);
    EXPECT_EQ(stage["metadata"]["metersPerUnit"], frame["meters_per_unit"]);
    const Outcome print = RunProgram("vdb_print", {"-m", (folder_ / out / "scene.vdb").string()});
    EXPECT_THAT(print.out, HasSubstr(frame["up_axis"] == "y" ? "\"up_axis\":\"y\"" : "up_axis"));
  }
  EXPECT_EQ(Labels("y")["frame"]["unit"], "cm");
  EXPECT_EQ(Labels("y")["frame"]["up_axis"], "y");
  EXPECT_EQ(Labels("moved")["frame"]["file_from_colmap"],
            json({-100., 0., 0., 500., 0., -100., 0., 600., 0., 0., 100., 700., 0., 0., 0., 1.}));
}

// A crop is of the COLMAP frame, whatever the frame of the files; voxels are of the files.
TEST_F(ExportOptionsTest, ACropCutsTheSameInEveryFrame) {
  const auto voxels = [&](const std::string& out, std::vector<std::string> options) {
    options.insert(options.end(), {"--crop", "9.5,19.5,29.5,10.2,20.5,30.5"});
    EXPECT_EQ(Run("volume_exporter", out, options).exit_code, 0);
    return VoxelCenters(folder_ / out / "scene.vdb").size();
  };
  const size_t cropped = voxels("colmap", {"--voxel_size", "0.05"});
  EXPECT_GT(cropped, 100u);
  EXPECT_EQ(voxels("scaled", {"--voxel_size", "0.1", "--scale", "2"}), cropped);
  EXPECT_EQ(voxels("turned", {"--voxel_size", "0.05", "--up_axis", "z"}), cropped);
  ASSERT_EQ(Run("volume_exporter", "whole", {"--voxel_size", "0.05"}).exit_code, 0);
  EXPECT_GT(VoxelCenters(folder_ / "whole" / "scene.vdb").size(), cropped);
}

// Renamed grids, and the options of a later export, do not confuse the stage.
TEST_F(ExportOptionsTest, TheStageNamesTheGridsAsTheVolumesDo) {
  ASSERT_EQ(Run("volume_exporter",
                "out",
                {"--max_resolution", "16", "--VolumeExport.color_grid_name", "Cd"})
                .exit_code,
            0);
  ASSERT_EQ(Run("mesh_exporter", "out", {"--formats", "usda"}).exit_code, 0);
  const json stage = UsdaReader::Read(folder_ / "out/scene.usda");
  const json& volume =
      stage["children"]["scene"]["children"]["mug"]["children"]["volume"]["children"];
  EXPECT_EQ(volume["color"]["properties"]["fieldName"]["value"], "Cd");
  EXPECT_EQ(volume["surface"]["properties"]["fieldName"]["value"], "surface");
}

// Both exporters take them, and both say what is left out.
TEST_F(ExportOptionsTest, ComponentsAreThoseAskedFor) {
  // A second ball of the mug's, with a quarter of its cells.
  Model model = MakeModel(RandomSites(3000, 1), 2, [](const Eigen::Vector3f& p) {
    if ((p - Eigen::Vector3f(-0.4f, 0, 0)).norm() < 0.4f) return 0;
    if ((p - Eigen::Vector3f(0.45f, 0.4f, 0)).norm() < 0.25f) return 0;
    return (p - Eigen::Vector3f(0.45f, -0.45f, 0)).norm() < 0.2f ? 1 : kAir;
  });
  WriteModel(folder_ / "scene.foam", model);
  const auto all = [](std::vector<std::string> options) {
    options.insert(options.end(), {"--formats", "ply"});
    return options;
  };
  ASSERT_EQ(Run("mesh_exporter", "all", all({})).exit_code, 0);
  const json whole = Labels("all")["objects"];
  ASSERT_EQ(whole.size(), 2u);
  EXPECT_EQ(whole[0]["pieces"], 2);

  const Outcome largest = Run("mesh_exporter", "largest", all({"--keep_largest", "1"}));
  ASSERT_EQ(largest.exit_code, 0) << largest.err;
  EXPECT_THAT(largest.err, HasSubstr("Left out of mug (7): 1 component of "));
  const json kept = Labels("largest")["objects"];
  EXPECT_EQ(kept[0]["pieces"], 1);
  EXPECT_EQ(kept[0]["left_out"]["pieces"], 1);
  EXPECT_NEAR(kept[0]["left_out"]["largest"]["center"][0].get<double>(), 0.45, 0.1);
  EXPECT_EQ(kept[0]["cells"].get<int>() + kept[0]["left_out"]["cells"].get<int>(),
            whole[0]["cells"].get<int>());
  EXPECT_LT(kept[0]["bounding_box"][1][0].get<double>(), 0.3);
  EXPECT_EQ(kept[1], whole[1]);

  const int few = whole[1]["cells"].get<int>();
  ASSERT_LT(few, kept[0]["left_out"]["cells"].get<int>());
  const Outcome large = Run("volume_exporter",
                            "large",
                            {"--max_resolution", "16", "--min_cells", std::to_string(few + 1)});
  ASSERT_EQ(large.exit_code, 0) << large.err;
  EXPECT_THAT(large.err,
              HasSubstr("No object label_8 (8), too few cells in every piece: 1 component of "));
  EXPECT_THAT(FilesBelow(folder_ / "large"),
              UnorderedElementsAre("labels.json", "scene.vdb", "objects/7_mug.vdb"));
  EXPECT_EQ(Labels("large")["objects"][0]["pieces"], 2);
  EXPECT_EQ(Labels("large")["labels_left_out"][0]["id"], 8);
  EXPECT_EQ(Labels("large")["labels"]["8"], "label_8");

  for (const std::string command : {"mesh_exporter", "volume_exporter"}) {
    for (const std::string option : {"--keep_largest", "--min_cells"}) {
      for (const std::string value : {"-1", "many"}) {
        const Outcome refused = Run(command, "refused", {option, value});
        EXPECT_EQ(refused.exit_code, 1) << command << option << value;
        ASSERT_THAT(refused.Errors(), SizeIs(1)) << refused.err;
        EXPECT_THAT(refused.Errors()[0], HasSubstr("for option '" + option + "' is invalid"));
      }
    }
  }
  EXPECT_THAT(FilesBelow(folder_ / "refused"), testing::IsEmpty());
}

// Of a foam without objects there is no mesh, and so nothing at all.
TEST_F(ExportOptionsTest, WithoutObjectsThereIsNothingToWrite) {
  const std::string foam = (folder_ / "scene.foam").string();
  const auto expect_refusal = [&](const std::vector<std::string>& named,
                                  const std::string& kind,
                                  const std::vector<std::string>& options) {
    ExpectRefused(Run("mesh_exporter", "none", options), {foam, named, kind});
    EXPECT_FALSE(fs::exists(folder_ / "none"));
  };
  expect_refusal({"min_cells"}, "left out, so there is no surface", {"--min_cells", "1000000"});
  Model model = ReadModel(foam);
  const Foam labelled = model.foam;
  model.foam.raw_density.assign(model.foam.NumSites(), -100);
  WriteModel(foam, model);
  expect_refusal({"none of its 2 labels", "volume_exporter"}, "solid cells", {});
  model.foam = labelled;
  model.foam.num_classes = 0;
  model.foam.identity.clear();
  model.foam.classifier_weight.clear();
  model.foam.classifier_bias.clear();
  model.labels.clear();
  WriteModel(foam, model);
  const Foam unlabelled = model.foam;
  model.foam.raw_density.assign(model.foam.NumSites(), -100);
  WriteModel(foam, model);
  expect_refusal({"longer training"}, "nothing in it is solid", {"--formats", "glb"});
  model.foam = unlabelled;
  WriteModel(foam, model);
  const Outcome object = Run("volume_exporter", "none", {"--labels", "mug"});
  EXPECT_EQ(object.exit_code, 1);
  EXPECT_THAT(object.Errors(), testing::ElementsAre(HasSubstr("the scene has no objects")));
  EXPECT_FALSE(fs::exists(folder_ / "none"));
  EXPECT_EQ(Run("volume_exporter", "scene", {"--max_resolution", "16"}).exit_code, 0);
  EXPECT_THAT(FilesBelow(folder_ / "scene"), UnorderedElementsAre("scene.vdb", "labels.json"));
}

// Without masks there is a mesh, too: all matter as one closed surface.
TEST_F(ExportOptionsTest, WithoutLabelsTheWholeSceneIsOneMesh) {
  ASSERT_EQ(Run("mesh_exporter", "apart", {"--formats", "obj"}).exit_code, 0);
  Model model = ReadModel(folder_ / "scene.foam");
  model.foam.num_classes = 0;
  model.foam.identity.clear();
  model.foam.classifier_weight.clear();
  model.foam.classifier_bias.clear();
  model.labels.clear();
  WriteModel(folder_ / "scene.foam", model);
  const Outcome whole = Run("mesh_exporter", "whole");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.err, HasSubstr("1 shell, no cavities, genus 0"));
  EXPECT_THAT(FilesBelow(folder_ / "whole"),
              UnorderedElementsAre("labels.json",
                                   "scene.om",
                                   "scene.ply",
                                   "scene.obj",
                                   "scene.mtl",
                                   "scene.glb",
                                   "scene.usda"));
  ExpectListed("whole");
  EXPECT_EQ(Labels("whole")["objects"], json::array());
  // Both balls, which touch, in one.
  const auto box = [&](const std::vector<std::string>& paths) {
    Eigen::AlignedBox3d of_all;
    for (const std::string& path : paths) {
      for (const Eigen::Vector3d& vertex : ObjVertices(folder_ / path)) of_all.extend(vertex);
    }
    return of_all;
  };
  const Eigen::AlignedBox3d of_whole = box({"whole/scene.obj"});
  const Eigen::AlignedBox3d of_parts =
      box({"apart/objects/7_mug.obj", "apart/objects/8_label_8.obj"});
  EXPECT_LT((of_whole.min() - of_parts.min()).norm(), 0.1);
  EXPECT_LT((of_whole.max() - of_parts.max()).norm(), 0.1);
  ExpectRefused(Run("mesh_exporter", "mug", {"--labels", "mug"}),
                {"", {"mug"}, "the scene has no objects"});
  EXPECT_FALSE(fs::exists(folder_ / "mug"));
}

TEST_F(ExportOptionsTest, ACropCutsMeshes) {
  for (const std::string method : {"smooth", "cells"}) {
    const Outcome cut = Run("mesh_exporter",
                            method,
                            {"--method", method, "--formats", "obj", "--crop", "0,0,0,10,40,60"});
    ASSERT_EQ(cut.exit_code, 0) << cut.err;
    double right = 0;
    for (const std::string name : {"7_mug", "8_label_8"}) {
      if (!fs::exists(folder_ / method / "objects" / (name + ".obj"))) continue;
      for (const Eigen::Vector3d& x : ObjVertices(folder_ / method / "objects" / (name + ".obj"))) {
        right = std::max(right, x.x());
      }
    }
    EXPECT_NEAR(right, 10, method == "smooth" ? 1e-9 : 0.5) << method;
    ExpectListed(method);
  }
  ExpectRefused(Run("mesh_exporter", "bad", {"--crop", "1,2,3"}), {"", {"crop"}, "six numbers"});
  EXPECT_FALSE(fs::exists(folder_ / "bad"));
}

TEST_F(ExportOptionsTest, OneFolderHoldsOneFrame) {
  ASSERT_EQ(Run("mesh_exporter", "out", {"--formats", "ply,obj"}).exit_code, 0);
  const std::string before = ReadFile(folder_ / "out/labels.json");
  for (const Outcome& refused :
       {Run("volume_exporter", "out", {"--scale", "2"}),
        Run("mesh_exporter", "out", {"--scale", "2", "--formats", "ply"})}) {
    EXPECT_EQ(refused.exit_code, 1);
    ASSERT_THAT(refused.Errors(), SizeIs(1)) << refused.err;
    EXPECT_THAT(refused.Errors()[0], HasSubstr("is in another frame than this export"));
  }
  EXPECT_EQ(ReadFile(folder_ / "out/labels.json"), before);
  // All of it anew is another matter.
  EXPECT_EQ(Run("mesh_exporter", "out", {"--scale", "2", "--formats", "ply,obj"}).exit_code, 0);
  EXPECT_EQ(Labels("out")["frame"]["file_from_colmap"][0], 2);
  // Nor may a training go there.
  const Outcome training = RunSemfoam(TinyTraining({"foam_trainer",
                                                    "--image_path",
                                                    (kTabletop / "images").string(),
                                                    "--input_path",
                                                    (kTabletop / "sparse/0").string(),
                                                    "--output_path",
                                                    (folder_ / "out").string()}));
  EXPECT_EQ(training.exit_code, 1);
  ASSERT_THAT(training.Errors(), SizeIs(1)) << training.err;
  EXPECT_THAT(training.Errors()[0], HasSubstr("is of another foam, as labels.json there says"));
  EXPECT_FALSE(fs::exists(folder_ / "out/scene.foam"));
}

// What has no frame or no objects is not ours and stays: tools/cli/input_protection_test.
TEST_F(ExportOptionsTest, ALabelsFileThatWasSpoiltIsReplaced) {
  fs::create_directories(folder_ / "out");
  for (const char* text :
       {R"({"frame": 1, "objects": 2})",
        R"({"frame": {}, "objects": [3], "files": 4})",
        R"({"frame": {}, "objects": [{"files": 5}], "files": {"ply": 6, "vdb": "gone.vdb"}})"}) {
    WriteFile(folder_ / "out/labels.json", text);
    const Outcome outcome = Run("mesh_exporter", "out", {"--formats", "glb", "--scale", "2"});
    EXPECT_EQ(outcome.exit_code, 0) << text << outcome.err;
    ExpectListed("out");
  }
}

TEST_F(ExportOptionsTest, TheWholeRunTakesThemToo) {
  const Outcome outcome = RunSemfoam(TinyTraining({"automatic_segmenter",
                                                   "--workspace_path",
                                                   kTabletop.string(),
                                                   "--output_path",
                                                   (folder_ / "run").string(),
                                                   "--FoamTraining.num_rays",
                                                   "100000",
                                                   "--formats",
                                                   "ply",
                                                   "--up_axis",
                                                   "y",
                                                   "--units",
                                                   "m"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const std::string& file : FilesBelow(folder_ / "run/objects")) {
    EXPECT_EQ(fs::path(file).extension(), ".ply") << file;
  }
  EXPECT_FALSE(fs::exists(folder_ / "run/scene.vdb"));
  EXPECT_FALSE(fs::exists(folder_ / "run/scene.glb"));
  // The tabletop's z is up.
  EXPECT_EQ(Labels("run")["frame"]["file_from_colmap"],
            json({1., 0., 0., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1.}));
  EXPECT_EQ(Labels("run")["frame"]["unit"], "m");
}

}  // namespace
}  // namespace semfoam
