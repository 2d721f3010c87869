// SPDX-License-Identifier: GPL-3.0-or-later
//
// Level and to scale: the options of the exporters, and model_aligner.
#include "foam/geometry/plane_fit.h"
#include "foam/model/model.h"
#include "foam/util/number_text.h"
#include "plugin/colmap/colmap_model.h"

#include <cmath>
#include <cstring>
#include <map>
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
using ::testing::UnorderedElementsAre;

const Eigen::Vector3d kUp = Eigen::Vector3d(0.3, -0.2, 1).normalized();

double DegreesOff(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI;
}

// A tilted slab, mug (7), with a ball, label_8 (8), above it, and a ring of level photos around.
Model TiltedScene() {
  Model model = MakeModel(RandomSites(5000, 3), 2, [](const Eigen::Vector3f& p) {
    const double height = p.cast<double>().dot(kUp);
    if ((p - Eigen::Vector3f(0, 0, 0.5f)).norm() < 0.25f) return 1;
    return height < 0 && height > -0.4 ? 0 : kAir;
  });
  model.world_from_normalized = {2, {10, 20, 30}};
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), kUp);
  for (int k = 0; k < 12; ++k) {
    const double yaw = 2 * M_PI * k / 12;
    PhotoRecord photo;
    photo.name = std::to_string(k) + ".jpg";
    photo.camera_model = "SIMPLE_PINHOLE";
    photo.width = photo.height = 10;
    photo.camera_params = {10, 5, 5};
    Eigen::Matrix3d level;
    level << -std::sin(yaw), std::cos(yaw), 0, 0, 0, -1, -std::cos(yaw), -std::sin(yaw), 0;
    photo.cam_from_world_rotation = Eigen::Quaterniond(level) * turn.conjugate();
    const Eigen::Vector3d center = turn * Eigen::Vector3d(3 * std::cos(yaw), 3 * std::sin(yaw), 2);
    photo.cam_from_world_translation =
        -(photo.cam_from_world_rotation * (center + Eigen::Vector3d(10, 20, 30)));
    model.photos.push_back(photo);
  }
  return model;
}

struct Frame {
  Eigen::Matrix4d file_from_colmap;
  explicit Frame(const json& numbers) {
    for (int k = 0; k < 16; ++k) file_from_colmap(k / 4, k % 4) = numbers[k];
  }
  Eigen::Vector3d Apply(const Eigen::Vector3d& x) const {
    return (file_from_colmap * x.homogeneous()).head<3>();
  }
  Eigen::Vector3d Turn(const Eigen::Vector3d& x) const {
    return file_from_colmap.topLeftCorner<3, 3>() * x;
  }
};

class LevelTest : public testing::Test {
 protected:
  void SetUp() override { WriteModel(folder_ / "scene.foam", TiltedScene()); }

  Outcome Run(const std::string& command,
              const std::string& out,
              const std::vector<std::string>& options = {}) {
    return RunExporter(command, folder_ / "scene.foam", folder_ / out, options);
  }

  void ExportAll(const std::string& out, const std::vector<std::string>& frame) {
    std::vector<std::string> volume = {"--VolumeExport.max_resolution", "16"};
    volume.insert(volume.end(), frame.begin(), frame.end());
    const Outcome volumes = Run("volume_exporter", out, volume);
    ASSERT_EQ(volumes.exit_code, 0) << volumes.err;
    const Outcome meshes = Run("mesh_exporter", out, frame);
    ASSERT_EQ(meshes.exit_code, 0) << meshes.err;
  }

  TempFolder folder_;
};

std::vector<Eigen::Vector3d> PlyVertices(const fs::path& path) {
  const std::string bytes = ReadFile(path);
  const size_t header = bytes.find("end_header\n") + 11;
  size_t count = 0;
  std::istringstream(bytes.substr(bytes.find("element vertex ") + 15)) >> count;
  // Doubles x, y, z come first; the rest of a vertex is measured by what a face takes.
  std::vector<Eigen::Vector3d> vertices(1);
  std::memcpy(vertices[0].data(), bytes.data() + header, sizeof(Eigen::Vector3d));
  EXPECT_GT(count, 0u);
  return vertices;
}

TEST_F(LevelTest, EveryFormatIsInTheLevelFrame) {
  ExportAll("plain", {});
  ExportAll("level", {"--level", "mug", "--scale_points", "0,0,0 0,3,4", "--scale_distance", "50"});
  const json frame = LabelsIn(folder_ / "level")["frame"];
  EXPECT_EQ(frame["up_axis"], "z");
  EXPECT_LT(frame["up_tilt_degrees"], 1.5);
  const Frame moved(frame["file_from_colmap"]);
  EXPECT_LT(DegreesOff(moved.Turn(kUp), Eigen::Vector3d::UnitZ()), 1.5);
  EXPECT_NEAR(moved.Turn(kUp).norm(), 10, 1e-9);

  const auto expect = [&](const std::vector<Eigen::Vector3d>& from,
                          const std::vector<Eigen::Vector3d>& to,
                          const std::string& what) {
    ASSERT_FALSE(from.empty()) << what;
    ASSERT_EQ(from.size(), to.size()) << what;
    for (size_t k = 0; k < from.size(); ++k) {
      ASSERT_LT((moved.Apply(from[k]) - to[k]).norm(), 1e-3) << what;
    }
  };
  const fs::path plain = folder_ / "plain", level = folder_ / "level";
  for (const std::string name : {"7_mug", "8_label_8"}) {
    const std::string obj = "objects/" + name + ".obj", glb = "objects/" + name + ".glb";
    const std::string ply = "objects/" + name + ".ply";
    expect(ObjVertices(plain / obj), ObjVertices(level / obj), obj);
    expect(ImportedVertices(ReadGlb(plain / glb)), ImportedVertices(ReadGlb(level / glb)), glb);
    expect(PlyVertices(plain / ply), PlyVertices(level / ply), ply);
  }
  EXPECT_EQ(ReadGlb(level / "scene.glb").json["nodes"][0]["extras"]["frame"], frame);
  const json stage = UsdaReader::Read(level / "scene.usda");
  EXPECT_EQ(json::parse(stage["metadata"]["customLayerData"]["frame"].get<std::string>()), frame);
  const Outcome print = RunProgram("vdb_print", {"-m", (level / "scene.vdb").string()});
  EXPECT_THAT(print.out, HasSubstr("\"up_axis\":\"z\""));

  // The slab's top is level in the files.
  SurfaceSamples samples;
  samples.points = ObjVertices(level / "objects/7_mug.obj");
  samples.weights.assign(samples.points.size(), 1);
  samples.tolerance = 1;
  const std::optional<PlaneFit> top = FitPlane(samples);
  ASSERT_TRUE(top);
  EXPECT_LT(std::min(DegreesOff(top->normal, Eigen::Vector3d::UnitZ()),
                     DegreesOff(top->normal, -Eigen::Vector3d::UnitZ())),
            2);
}

TEST_F(LevelTest, TheLogTellsHowLevelItIs) {
  const Outcome label =
      Run("mesh_exporter", "label", {"--formats", "ply", "--level", "7", "--level_to_zero", "1"});
  ASSERT_EQ(label.exit_code, 0) << label.err;
  EXPECT_THAT(label.err, HasSubstr("level 7 turned the model by "));
  EXPECT_THAT(label.err, HasSubstr(" off it (rms), at height 0, below 12 of 12 cameras; the "));
  EXPECT_THAT(label.err, testing::Not(HasSubstr("WARNING")));
  const Outcome cameras =
      Run("mesh_exporter", "cameras", {"--formats", "ply", "--level", "cameras"});
  ASSERT_EQ(cameras.exit_code, 0) << cameras.err;
  EXPECT_THAT(cameras.err, HasSubstr("level cameras turned the model by 19.8"));
  EXPECT_THAT(cameras.err, HasSubstr("off level by 0.00 degrees in the median"));
  // What is not flat is told.
  const Outcome ball = Run("mesh_exporter", "ball", {"--formats", "ply", "--level", "8"});
  ASSERT_EQ(ball.exit_code, 0) << ball.err;
  EXPECT_THAT(ball.err, HasSubstr(" off it (rms), at height "));
  EXPECT_THAT(ball.err,
              HasSubstr("WARNING: The normal of 8 and the photos' upward direction are "));
}

TEST_F(LevelTest, AnyNumberOfThreadsGivesTheSameBytes) {
  for (const std::string threads : {"1", "2", "5"}) {
    const Outcome outcome = Run("mesh_exporter",
                                threads,
                                {"--formats", "glb", "--level", "plane", "--num_threads", threads});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(ReadFile(folder_ / threads / "scene.glb"), ReadFile(folder_ / "1" / "scene.glb"));
    EXPECT_EQ(ReadFile(folder_ / threads / "labels.json"), ReadFile(folder_ / "1" / "labels.json"));
  }
}

TEST_F(LevelTest, UpAxisColmapUndoesIt) {
  ASSERT_EQ(Run("mesh_exporter", "plain", {"--formats", "glb"}).exit_code, 0);
  const Outcome level =
      Run("mesh_exporter", "undone", {"--formats", "glb", "--level", "mug", "--up_axis", "colmap"});
  ASSERT_EQ(level.exit_code, 0) << level.err;
  EXPECT_THAT(level.err, HasSubstr("up_axis colmap undoes level"));
  for (const std::string& file : FilesBelow(folder_ / "plain")) {
    EXPECT_EQ(ReadFile(folder_ / "plain" / file), ReadFile(folder_ / "undone" / file)) << file;
  }
}

TEST_F(LevelTest, MeasuredPositionsBringItToItsPlace) {
  std::string text, on_a_line;
  for (const PhotoRecord& photo : TiltedScene().photos) {
    const Eigen::Vector3d x =
        -(photo.cam_from_world_rotation.conjugate() * photo.cam_from_world_translation);
    std::ostringstream line;
    line.precision(12);
    line << photo.name << " " << 3 * x.y() << " " << -3 * x.x() << " " << 3 * x.z() + 100 << "\n";
    text += line.str();
    on_a_line += photo.name + " " + photo.name.substr(0, photo.name.find('.')) + " 0 0\n";
  }
  WriteFile(folder_ / "positions.txt", text);
  const std::string path = (folder_ / "positions.txt").string();
  const Outcome outcome =
      Run("mesh_exporter", "out", {"--formats", "glb", "--ref_images_path", path});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Positions of 12 photos fit the model, scaled by 3, to "));
  const Frame frame(LabelsIn(folder_ / "out")["frame"]["file_from_colmap"]);
  EXPECT_LT((frame.Apply({1, 2, 3}) - Eigen::Vector3d(6, -3, 109)).norm(), 1e-6);
  WriteFile(folder_ / "positions.txt", on_a_line);
  ExpectRefused(Run("mesh_exporter", "bad", {"--ref_images_path", path}),
                {"", {"ref_images_path", "12"}, "lie on one line"});
  WriteFile(folder_ / "positions.txt", "0.jpg 1 2 3\nb.jpg 1 2 3\n");
  ExpectRefused(Run("mesh_exporter", "bad", {"--ref_images_path", path}),
                {"", {"ref_images_path", "1", "12", "0.jpg"}, "three or more"});
  EXPECT_THAT(FilesBelow(folder_ / "bad"), testing::IsEmpty());
}

TEST_F(LevelTest, AnAlignedFoamIsTheFoamInAnotherFrame) {
  const Outcome aligned = Run("model_aligner", "aligned", {"--level", "mug", "--scale", "2"});
  ASSERT_EQ(aligned.exit_code, 0) << aligned.err;
  EXPECT_THAT(FilesBelow(folder_ / "aligned"), UnorderedElementsAre("scene.foam", "frame.json"));
  const json frame = json::parse(ReadFile(folder_ / "aligned/frame.json"));
  const Frame moved(frame["file_from_colmap"]);
  const Model before = TiltedScene(), after = ReadModel(folder_ / "aligned/scene.foam");
  ASSERT_EQ(after.foam.NumSites(), before.foam.NumSites());
  EXPECT_EQ(after.world_from_normalized.scale, 4);
  for (size_t k = 0; k < before.photos.size(); ++k) {
    const auto center = [](const PhotoRecord& photo) -> Eigen::Vector3d {
      return -(photo.cam_from_world_rotation.conjugate() * photo.cam_from_world_translation);
    };
    EXPECT_LT((moved.Apply(center(before.photos[k])) - center(after.photos[k])).norm(), 1e-9);
  }
  // Exporting the aligned foam as it is gives what levelling the export gives.
  ASSERT_EQ(
      Run("mesh_exporter",
          "level",
          {"--formats", "obj", "--level", "mug", "--scale", "2", "--MeshExport.method", "cells"})
          .exit_code,
      0);
  ASSERT_EQ(RunExporter("mesh_exporter",
                        folder_ / "aligned/scene.foam",
                        folder_ / "again",
                        {"--formats", "obj", "--MeshExport.method", "cells"})
                .exit_code,
            0);
  // The slab, the first object, reaches to the guards around all sites, which do not turn.
  const json ball = LabelsIn(folder_ / "level")["objects"][1];
  const json again = LabelsIn(folder_ / "again")["objects"][1];
  EXPECT_EQ(ball["id"], 8);
  EXPECT_NEAR(again["volume"], ball["volume"], 1e-3 * ball["volume"].get<double>());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(again["centroid"][axis], ball["centroid"][axis], 1e-2);
  }
}

TEST_F(LevelTest, FoamAndColmapModelMoveTogetherAndBack) {
  const std::string sparse = (kTabletop / "sparse/0").string();
  const std::string foam = (folder_ / "tabletop.foam").string();
  ASSERT_EQ(RunSemfoam({"foam_converter", "--input_path", sparse, "--output_path", foam}).exit_code,
            0);
  const fs::path tilted = folder_ / "tilted", level = folder_ / "level", back = folder_ / "back";
  const auto align = [&](const std::string& from_foam,
                         const std::string& from_model,
                         const fs::path& to,
                         std::vector<std::string> options) {
    options.insert(options.begin(),
                   {"model_aligner",
                    "--foam_path",
                    from_foam,
                    "--input_path",
                    from_model,
                    "--output_path",
                    to.string()});
    const Outcome outcome = RunSemfoam(options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  };
  // About (1, 2, 2) / 3 by 180 degrees.
  align(foam,
        sparse,
        tilted,
        {"--transform",
         "-0.777777777777778 0.444444444444444 0.444444444444444 5 "
         "0.444444444444444 -0.111111111111111 0.888888888888889 6 "
         "0.444444444444444 0.888888888888889 -0.111111111111111 7"});
  const std::string said = align((tilted / "scene.foam").string(),
                                 (tilted / "sparse/0").string(),
                                 level,
                                 {"--level", "plane"});
  EXPECT_THAT(said, HasSubstr("cameras; the photos' upward direction is "));
  // The table of this scene stands on z; its floor is found level again.
  const json to_level = json::parse(ReadFile(level / "frame.json"));
  const json to_tilted = json::parse(ReadFile(tilted / "frame.json"));
  const Eigen::Vector3d up =
      Frame(to_level["file_from_colmap"])
          .Turn(Frame(to_tilted["file_from_colmap"]).Turn(Eigen::Vector3d::UnitZ()));
  EXPECT_LT(DegreesOff(up, Eigen::Vector3d::UnitZ()), 1);
  // And back, by the inverse that the file tells.
  std::string inverse;
  for (const json& number : to_level["colmap_from_file"]) {
    inverse += FormatNumber(number.get<double>()) + " ";
  }
  align((level / "scene.foam").string(),
        (level / "sparse/0").string(),
        back,
        {"--transform", inverse});
  const Reconstruction before = ReadReconstruction(tilted / "sparse/0");
  const Reconstruction after = ReadReconstruction(back / "sparse/0");
  ASSERT_EQ(before.images.size(), after.images.size());
  for (size_t k = 0; k < before.images.size(); ++k) {
    EXPECT_LT(
        (before.images[k].cam_from_world.Center() - after.images[k].cam_from_world.Center()).norm(),
        1e-9);
  }
}

TEST_F(LevelTest, MeasuredPositionsAreFittedAsColmapFitsThem) {
  const std::string sparse = (kTabletop / "sparse/0").string();
  std::ostringstream text;
  text.precision(12);
  for (const Image& image : ReadReconstruction(sparse).images) {
    const Eigen::Vector3d x = image.cam_from_world.Center();
    // With some noise.
    const Eigen::Vector3d noise =
        0.02 * Eigen::Vector3d(std::sin(image.id), std::cos(3 * image.id), std::sin(7 * image.id));
    text << image.name << " "
         << (2.5 * Eigen::Vector3d(x.y(), -x.x(), x.z()) + Eigen::Vector3d(4e5, 5e6, 300) + noise)
                .transpose()
         << "\n";
  }
  text << "missing.jpg 0 0 0\n";
  const fs::path positions = folder_ / "positions.txt";
  WriteFile(positions, text.str());
  const Outcome ours = RunSemfoam({"model_aligner",
                                   "--input_path",
                                   sparse,
                                   "--output_path",
                                   (folder_ / "ours").string(),
                                   "--ref_images_path",
                                   positions.string()});
  ASSERT_EQ(ours.exit_code, 0) << ours.err;
  const Outcome help =
      RunProgram("env", {"QT_QPA_PLATFORM=offscreen", "colmap", "model_aligner", "-h"});
  const bool is_new =  // as COLMAP 3.10, not 3.8
      (help.out + help.err).find(" --alignment_max_error") != std::string::npos;
  fs::create_directories(folder_ / "theirs");
  const Outcome theirs =
      RunProgram("env",
                 {"QT_QPA_PLATFORM=offscreen",
                  "colmap",
                  "model_aligner",
                  "--input_path",
                  sparse,
                  "--output_path",
                  (folder_ / "theirs").string(),
                  "--ref_images_path",
                  positions.string(),
                  "--ref_is_gps",
                  "0",
                  is_new ? "--alignment_max_error" : "--robust_alignment_max_error",
                  "1"});
  ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
  std::map<std::string, Eigen::Vector3d> expected;
  for (const Image& image : ReadReconstruction(folder_ / "theirs").images) {
    expected[image.name] = image.cam_from_world.Center();
  }
  ASSERT_EQ(expected.size(), 64u);
  for (const Image& image : ReadReconstruction(folder_ / "ours/sparse/0").images) {
    EXPECT_LT((image.cam_from_world.Center() - expected.at(image.name)).norm(), 1e-6);
  }
}

TEST_F(LevelTest, WhatCannotBeAlignedIsRefused) {
  const std::string foam = (folder_ / "scene.foam").string();
  const std::string sparse = (kTabletop / "sparse/0").string();
  const fs::path out = folder_ / "out";
  ExpectEachRefused(
      {"model_aligner", "--output_path", out.string()},
      {{{}, {"", {"foam_path", "input_path"}, "neither"}},
       {{"--foam_path", foam, "--input_path", sparse},
        {sparse, {"scene.foam"}, "no photo in common"}},
       {{"--foam_path", foam, "--level", "teapot"}, {"", {"level", "'teapot'"}, "is no object"}},
       {{"--input_path", sparse, "--level", "floor"},
        {"", {"level", "'floor'", "foam_path"}, "nothing has labels"}}},
      out);
}

}  // namespace
}  // namespace semfoam
