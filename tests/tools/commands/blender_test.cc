// SPDX-License-Identifier: GPL-3.0-or-later
//
// Blender, where it is installed, imports what we export: names, places, colours and grids are
// ours. The picture that it renders is kept beside the test program, to be looked at.
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/object_surface.h"
#include "foam/image/srgb.h"

#include <map>

#include "tests/export/test_foams.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Extent {
  Eigen::Vector3d low, high;
};
Extent ExtentOf(const json& thing) {
  const auto corner = [&](int which) {
    const json& c = thing["extent"][which];
    return Eigen::Vector3d(c[0], c[1], c[2]);
  };
  return {corner(0), corner(1)};
}

void ExpectMesh(const json& thing, const ObjectSurface& surface, const std::string& what) {
  SCOPED_TRACE(what);
  EXPECT_EQ(thing["type"], "MESH");
  EXPECT_EQ(thing["vertices"], surface.vertices.size());
  EXPECT_EQ(thing["faces"], surface.triangles.size());
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : surface.vertices) box.extend(vertex);
  EXPECT_LT((ExtentOf(thing).low - box.min()).norm(), 1e-5);
  EXPECT_LT((ExtentOf(thing).high - box.max()).norm(), 1e-5);
}

// Blender keeps colours in linear light.
void ExpectFirstColor(const json& thing, const ObjectSurface& surface) {
  ASSERT_TRUE(thing.contains("color"));
  for (int c = 0; c < 3; ++c) {
    const uint8_t display = surface.vertex_color[surface.triangles[0][0]][c];
    EXPECT_NEAR(thing["color"][c].get<double>(), LinearFromDisplay(display / 255.0), 0.002);
  }
}

// The box of a grid's active voxels, in the frame of the file.
Extent VoxelExtent(const fs::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  const auto grid = file.readGrid("density");
  const openvdb::BBoxd box = grid->transform().indexToWorld(grid->evalActiveVoxelBoundingBox());
  return {{box.min().x(), box.min().y(), box.min().z()},
          {box.max().x(), box.max().y(), box.max().z()}};
}

TEST(Blender, ShowsWhatWeExport) {
  const Outcome version = RunProgram("blender", {"--version"});
  if (version.exit_code == 127) GTEST_SKIP() << "blender is not installed";
  if (version.out.rfind("Blender 3.", 0) != 0) {
    GTEST_SKIP() << "blender_import.py speaks to Blender 3, and this is " << version.out;
  }
  const TempFolder folder;
  Model model = TouchingBalls(3000);
  model.labels[1].name = "M\xC3\xBCtze 2";
  const ExportableScene scene = MakeExportableScene(model);
  VolumeExportOptions volume;
  volume.max_resolution = 64;
  ExportVolumes(scene, folder / "out", volume);
  SurfaceExportOptions surface;
  surface.method = SurfaceMethod::kCells;
  ExportSurfaces(scene, folder / "out", surface);

  const fs::path picture = fs::current_path() / "blender_test.png";
  fs::remove(picture);
  const Outcome outcome = RunProgram("blender",
                                     {"--background",
                                      "--factory-startup",
                                      "--python-exit-code",
                                      "1",
                                      "--python",
                                      SEMFOAM_TEST_SOURCE "/tools/commands/blender_import.py",
                                      "--",
                                      (folder / "out").string(),
                                      (folder / "report.json").string(),
                                      picture.string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_GT(fs::file_size(picture), 10000u) << picture;
  const json report = json::parse(ReadFile(folder / "report.json"));

  std::map<std::string, json> in_scene;
  for (const json& thing : report["scene.glb"]) in_scene[thing["name"]] = thing;
  EXPECT_EQ(in_scene.size(), 4u) << "two objects below two empties";
  for (const ObjectInfo& object : scene.objects) {
    const ObjectSurface surface = ExtractSurface(scene, object);
    ASSERT_EQ(in_scene.count(object.name), 1u) << object.name;
    const json& thing = in_scene[object.name];
    ExpectMesh(thing, surface, "scene.glb");
    ExpectFirstColor(thing, surface);
    EXPECT_EQ(thing["properties"]["label"], object.id);
    EXPECT_EQ(thing["properties"]["name"], object.name);

    const std::string stem = "objects/" + object.file_stem;
    const auto only = [&](const std::string& extension) -> json {
      for (const json& part : report[stem + extension]) {
        if (part["type"] != "EMPTY") return part;
      }
      ADD_FAILURE() << stem + extension;
      return {};
    };
    ExpectMesh(only(".glb"), surface, ".glb");
    EXPECT_EQ(only(".glb")["name"], object.name);
    ExpectMesh(only(".obj"), surface, ".obj");
    EXPECT_EQ(only(".obj")["name"], object.file_stem);
    EXPECT_EQ(only(".obj")["materials"], json({object.file_stem}));
    ExpectFirstColor(only(".obj"), surface);
    ExpectMesh(only(".ply"), surface, ".ply");
    ExpectFirstColor(only(".ply"), surface);

    const json voxels = only(".vdb");
    EXPECT_EQ(voxels["type"], "VOLUME");
    EXPECT_EQ(voxels["grids"],
              (json{{"density", "FLOAT"},
                    {"color", "VECTOR_FLOAT"},
                    {"label", "FLOAT"},
                    {"confidence", "FLOAT"},
                    {"surface", "FLOAT"}}));
    // Blender's box is that of whole leaves, of eight voxels.
    const Extent ours = VoxelExtent(folder / "out" / (stem + ".vdb"));
    const double leaf = (ours.high - ours.low).maxCoeff() / 4;
    EXPECT_TRUE((ExtentOf(voxels).low.array() <= ours.low.array() + 1e-5).all());
    EXPECT_TRUE((ExtentOf(voxels).high.array() >= ours.high.array() - 1e-5).all());
    EXPECT_LT((ExtentOf(voxels).low - ours.low).cwiseAbs().maxCoeff(), leaf);
    EXPECT_LT((ExtentOf(voxels).high - ours.high).cwiseAbs().maxCoeff(), leaf);
  }
}

}  // namespace
}  // namespace semfoam
