// SPDX-License-Identifier: GPL-3.0-or-later
//
// The colour that leaves is what the photos show: in every format, for vertices, faces and voxels.
#include "export/scene/cell_colors.h"

#include "export/io/local_mesh.h"
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/object_surface.h"
#include "export/surface/semantic_mesh.h"
#include "foam/image/srgb.h"

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/export/io/read_glb.h"
#include "tests/export/io/read_usda.h"
#include "tests/export/test_foams.h"
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

using nlohmann::json;

const Eigen::Vector3f kSeen(0.8f, 0.4f, 0.2f);
const Color8 kSeen8 = {204, 102, 51};

// A ball whose shell photos show in kSeen, and whose inside and bottom they do not; the constant of
// all harmonics is nearly black.
Model DarkInside() {
  Model model = MakeModel(GridSites(16, 0.125f, 0.3f, 3), 1, [](const Eigen::Vector3f& p) {
    return p.norm() < 0.6f ? 0 : kAir;
  });
  for (float& value : model.foam.sh) value = -1.7f;
  for (const Eigen::Vector3f& p : model.foam.positions) {
    const bool is_seen = p.norm() > 0.35f && p.z() > -0.2f;
    model.statistics.contribution.push_back(is_seen ? 0.5f : p.x() > 0 ? 0.f : 0.01f);
    model.statistics.mean_color.push_back(is_seen ? kSeen : Eigen::Vector3f(0.02f, 0.02f, 0.02f));
  }
  return model;
}

class CellColors : public TemporaryFolderTest {};

TEST_F(CellColors, EveryFormatHoldsWhatPhotosShow) {
  const ExportableScene scene = MakeExportableScene(DarkInside());
  ExportSurfaces(scene, folder_);
  VolumeExportOptions volume;
  volume.max_resolution = 32;
  ExportVolumes(scene, folder_, volume);

  SemanticMesh om;
  OpenMesh::IO::Options with_colors(OpenMesh::IO::Options::VertexColor |
                                    OpenMesh::IO::Options::FaceColor);
  ASSERT_TRUE(OpenMesh::IO::read_mesh(om, (folder_ / "objects/7_mug.om").string(), with_colors));
  const OpenMesh::Vec3uc seen(kSeen8[0], kSeen8[1], kSeen8[2]);
  ASSERT_GT(om.n_vertices(), 100u);
  for (const auto vertex : om.vertices()) ASSERT_EQ(om.color(vertex), seen);
  for (const auto face : om.faces()) ASSERT_EQ(om.color(face), seen);

  SemanticMesh ply;
  with_colors = OpenMesh::IO::Options::VertexColor | OpenMesh::IO::Options::FaceColor;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(ply, (folder_ / "objects/7_mug.ply").string(), with_colors));
  for (const auto vertex : ply.vertices()) ASSERT_EQ(ply.color(vertex), seen);

  std::ifstream obj(folder_ / "objects/7_mug.obj");
  int vertices = 0;
  for (std::string line; std::getline(obj, line);) {
    std::istringstream words(line);
    std::string kind;
    if (!(words >> kind) || kind != "v") continue;
    double x, y, z, r, g, b;
    words >> x >> y >> z >> r >> g >> b;
    ASSERT_NEAR(r, 0.8, 1e-4);
    ASSERT_NEAR(g, 0.4, 1e-4);
    ASSERT_NEAR(b, 0.2, 1e-4);
    ++vertices;
  }
  EXPECT_EQ(vertices, static_cast<int>(om.n_vertices()));

  // Linear light.
  const json stage = UsdaReader::Read(folder_ / "scene.usda");
  const json& colors = stage["children"]["scene"]["children"]["mug"]["children"]["surface"]
                            ["properties"]["primvars:displayColor"]["value"];
  ASSERT_EQ(colors.size(), om.n_vertices());
  for (const json& color : colors) {
    for (int c = 0; c < 3; ++c) ASSERT_EQ(color[c].get<float>(), LinearLight(kSeen8[c]));
  }

  openvdb::initialize();
  openvdb::io::File file((folder_ / "objects/7_mug.vdb").string());
  file.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::Vec3SGrid>(file.readGrid("color"));
  ASSERT_GT(grid->activeVoxelCount(), 100u);
  for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
    for (int c = 0; c < 3; ++c) ASSERT_NEAR((*voxel)[c], LinearFromDisplay(kSeen[c]), 1e-6);
  }
}

TEST_F(CellColors, GlbVerticesAreTheSameInLinearLight) {
  const ExportableScene scene = MakeExportableScene(DarkInside());
  SurfaceExportOptions options;
  options.om = options.ply = options.obj = options.usda = false;
  ExportSurfaces(scene, folder_, options);
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  const std::vector<uint16_t> colors =
      ReadAccessor<uint16_t>(glb, glb.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]);
  ASSERT_GT(colors.size(), 400u);
  for (size_t k = 0; k < colors.size(); ++k) {
    const float light = k % 4 == 3 ? 1 : LinearFromDisplay(kSeen8[k % 4] / 255.f);
    ASSERT_EQ(colors[k], std::lround(65535 * light));
  }
}

TEST_F(CellColors, UnseenCellsTakeTheColourAroundThemAndNoOthers) {
  Model model = DarkInside();
  // Left half red, right half blue, where it is seen.
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    if (model.statistics.mean_color[i] != kSeen) continue;
    model.statistics.mean_color[i] =
        model.foam.positions[i].x() < 0 ? Eigen::Vector3f(1, 0, 0) : Eigen::Vector3f(0, 0, 1);
  }
  const ExportableScene scene = MakeExportableScene(model);
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    const Eigen::Vector3f& color = scene.display_color[i];
    if (scene.photographed[i] || scene.object_of_cell[i] < 0) {
      EXPECT_EQ(color, model.statistics.mean_color[i]);
      continue;
    }
    EXPECT_NEAR(color.x() + color.z(), 1, 1e-5) << i;
    EXPECT_NEAR(color.y(), 0, 1e-6);
    const float x = scene.cell_positions[i].x();
    if (x < -0.45f) {
      EXPECT_GT(color.x(), 0.6f);
    }
    if (x > 0.45f) {
      EXPECT_GT(color.z(), 0.6f);
    }
  }
}

// Cells meet in a vertex by what their rays saw of them.
TEST_F(CellColors, AVertexIsTheMeanByTheRaysWeight) {
  Model model = DarkInside();
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    const bool is_left = model.foam.positions[i].x() < 0;
    model.statistics.contribution[i] = is_left ? 0.8f : 0.1f;
    model.statistics.mean_color[i] = is_left ? Eigen::Vector3f(1, 1, 1) : Eigen::Vector3f(0, 0, 0);
  }
  const ExportableScene scene = MakeExportableScene(model);
  const ObjectInfo& object = scene.objects.at(0);
  const ObjectSurface surface = ExtractSurface(scene, object);
  std::set<int> mixtures;
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    int left = 0, right = 0;
    for (const uint32_t cell : scene.delaunay.tets[surface.vertex_tet[v]]) {
      if (cell >= scene.NumSites() || scene.object_of_cell[cell] != 0) continue;
      (scene.cell_positions[cell].x() < 0 ? left : right) += 1;
    }
    EXPECT_EQ(surface.vertex_color[v][0],
              std::lround(255 * 0.8 * left / (0.8 * left + 0.1 * right)));
    if (left > 0 && right > 0) mixtures.insert(surface.vertex_color[v][0]);
  }
  EXPECT_GE(mixtures.size(), 2u);
}

TEST_F(CellColors, AFoamWithoutStatisticsWeighsAllAlike) {
  Model model = DarkInside();
  model.statistics = {};
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(scene.color_weight, std::vector<float>(scene.NumSites(), 1.f));
  EXPECT_NEAR(scene.display_color[0].x(), 0.5f - 1.7f * 0.28209479f, 1e-6f);
}

}  // namespace
}  // namespace semfoam
