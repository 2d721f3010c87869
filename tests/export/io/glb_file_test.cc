// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/glb_file.h"

#include "export/io/surface_export.h"
#include "export/scene/object_surface.h"
#include "foam/util/error.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/export/io/read_glb.h"
#include "tests/export/io/test_texture.h"
#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;

// Two objects, the second with a name that needs care: quotes, UTF-8, a byte that is none.
Model NamedBalls(int count = 1500) {
  Model model = TouchingBalls(count);
  model.labels[1].name = "M\xC3\xBCtze \"blue\"\n\xFF";
  return model;
}
const std::string kCleanName = "M\xC3\xBCtze \"blue\" \xEF\xBF\xBD";

SurfaceExportOptions OnlyGlb() {
  SurfaceExportOptions options;
  options.method = SurfaceMethod::kCells;
  options.om = options.ply = options.obj = options.usda = false;
  return options;
}

class GlbFiles : public TemporaryFolderTest {
 protected:
  ExportableScene Export(const Model& model, const ExportTransform& transform = {}) {
    ExportableSceneOptions options;
    options.transform = transform;
    ExportableScene scene = MakeExportableScene(model, options);
    ExportSurfaces(scene, folder_, OnlyGlb());
    return scene;
  }
};

// The nodes with a mesh.
std::vector<json> ObjectNodes(const Glb& glb) {
  std::vector<json> nodes;
  for (const json& node : glb.json["nodes"]) {
    if (node.contains("mesh")) nodes.push_back(node);
  }
  return nodes;
}

TEST_F(GlbFiles, OneNamedNodePerObject) {
  const ExportableScene scene = Export(NamedBalls());
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  EXPECT_EQ(glb.json["asset"]["version"], "2.0");
  EXPECT_EQ(glb.json["asset"]["generator"], "Semantic Foam");
  const std::vector<json> nodes = ObjectNodes(glb);
  ASSERT_EQ(nodes.size(), 2u);
  EXPECT_EQ(nodes[0]["name"], "mug");
  EXPECT_EQ(nodes[1]["name"], kCleanName);
  for (size_t k = 0; k < 2; ++k) {
    const ObjectInfo& object = scene.objects[k];
    EXPECT_EQ(nodes[k]["extras"]["label"], object.id);
    EXPECT_EQ(nodes[k]["extras"]["name"], nodes[k]["name"]);
    EXPECT_EQ(nodes[k]["extras"]["confidence"], object.confidence);
    EXPECT_EQ(nodes[k]["extras"]["cells"], object.cells.size());
    EXPECT_EQ(nodes[k]["extras"]["volume"], object.volume);

    const Glb alone = ReadGlb(folder_ / ("objects/" + object.file_stem + ".glb"));
    const std::vector<json> its_nodes = ObjectNodes(alone);
    ASSERT_EQ(its_nodes.size(), 1u);
    EXPECT_EQ(its_nodes[0]["name"], nodes[k]["name"]);
    EXPECT_EQ(its_nodes[0]["extras"], nodes[k]["extras"]);
  }
}

TEST_F(GlbFiles, VerticesCarryWhatTheSurfaceDoes) {
  const ExportableScene scene = Export(NamedBalls());
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  for (size_t k = 0; k < 2; ++k) {
    const ObjectSurface surface = ExtractSurface(scene, scene.objects[k]);
    ASSERT_EQ(glb.json["meshes"][k]["primitives"].size(), 1u);
    const json& primitive = glb.json["meshes"][k]["primitives"][0];
    const json& attributes = primitive["attributes"];
    EXPECT_EQ(primitive.value("mode", 4), 4) << "triangles";

    const auto indices = ReadAccessor<uint32_t>(glb, primitive["indices"]);
    ASSERT_EQ(indices.size(), 3 * surface.triangles.size());
    for (size_t i = 0; i < indices.size(); ++i) {
      ASSERT_EQ(indices[i], surface.triangles[i / 3][i % 3]);
    }
    const auto colors = ReadAccessor<uint16_t>(glb, attributes["COLOR_0"]);
    EXPECT_EQ(glb.json["accessors"][attributes["COLOR_0"].get<int>()]["normalized"], true);
    const auto rows = ReadAccessor<float>(glb, attributes["_FEATURE_ID_0"]);
    const auto confidences = ReadAccessor<float>(glb, attributes["_CONFIDENCE"]);
    ASSERT_EQ(colors.size(), 4 * surface.vertices.size());
    ASSERT_EQ(rows.size(), surface.vertices.size());
    ASSERT_EQ(confidences, surface.vertex_confidence);
    for (size_t v = 0; v < surface.vertices.size(); ++v) {
      EXPECT_EQ(rows[v], static_cast<float>(k));
      EXPECT_EQ(colors[4 * v + 3], 65535);
      for (int c = 0; c < 3; ++c) {
        // Linear light, as the specification has it: back to what a photo would show.
        const double light = colors[4 * v + c] / 65535.0;
        const double display =
            light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
        EXPECT_EQ(std::lround(255 * display), surface.vertex_color[v][c]);
      }
    }
  }
}

TEST_F(GlbFiles, EveryDisplayValueSurvivesLinearLight) {
  for (int level = 0; level < 256; ++level) {
    const double light = std::lround(65535 * LinearLight(static_cast<uint8_t>(level))) / 65535.0;
    const double display =
        light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
    EXPECT_EQ(std::lround(255 * display), level);
  }
}

TEST_F(GlbFiles, NormalsAreUnitVectorsThatPointOutwards) {
  const ExportableScene scene = Export(TouchingBalls(3000));
  const Glb glb = ReadGlb(folder_ / "objects/7_mug.glb");
  const json& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  const auto normals = ReadAccessor<float>(glb, attributes["NORMAL"]);
  const ObjectSurface surface = ExtractSurface(scene, scene.objects[0]);
  ASSERT_EQ(normals.size(), 3 * surface.vertices.size());
  int outwards = 0;
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    const Eigen::Vector3d normal(normals[3 * v], normals[3 * v + 1], normals[3 * v + 2]);
    EXPECT_NEAR(normal.norm(), 1, 1e-6);
    outwards += normal.dot(surface.vertices[v] - Eigen::Vector3d(-0.3, 0, 0)) > 0;
  }
  // A ball of cells is rough, but not inside out.
  EXPECT_GT(outwards, 9 * static_cast<int>(surface.vertices.size()) / 10);
}

TEST_F(GlbFiles, AVertexWithoutAreaHasAUnitNormalToo) {
  ObjectSurface surface;
  surface.vertices.assign(3, Eigen::Vector3d(1, 2, 3));
  surface.triangles = {{0, 1, 2}};
  for (const Eigen::Vector3f& normal : MakeLocalMesh(surface).normals) {
    EXPECT_EQ(normal, Eigen::Vector3f::UnitZ());
  }
}

TEST_F(GlbFiles, ImportersThatAreZUpShowTheColmapNumbers) {
  const ExportableScene scene = Export(NamedBalls());
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  std::vector<Eigen::Vector3d> expected;
  for (const ObjectInfo& object : scene.objects) {
    const ObjectSurface surface = ExtractSurface(scene, object);
    expected.insert(expected.end(), surface.vertices.begin(), surface.vertices.end());
  }
  const std::vector<Eigen::Vector3d> imported = ImportedVertices(glb);
  ASSERT_EQ(imported.size(), expected.size());
  for (size_t v = 0; v < expected.size(); ++v) {
    EXPECT_LT((imported[v] - expected[v]).norm(), 1e-6);
  }
  for (const char* file : {"scene.glb", "objects/7_mug.glb"}) {
    EXPECT_EQ(ReadGlb(folder_ / file).json["nodes"][1]["translation"], json({0., 0., 0.}));
  }
}

TEST_F(GlbFiles, TheBoxesOfPositionsAreExact) {
  Export(NamedBalls());
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  for (const json& mesh : glb.json["meshes"]) {
    const int accessor = mesh["primitives"][0]["attributes"]["POSITION"];
    const auto positions = ReadAccessor<float>(glb, accessor);
    std::vector<float> low(3, INFINITY), high(3, -INFINITY);
    for (size_t k = 0; k < positions.size(); ++k) {
      low[k % 3] = std::min(low[k % 3], positions[k]);
      high[k % 3] = std::max(high[k % 3], positions[k]);
    }
    EXPECT_EQ(glb.json["accessors"][accessor]["min"].get<std::vector<float>>(), low);
    EXPECT_EQ(glb.json["accessors"][accessor]["max"].get<std::vector<float>>(), high);
  }
}

TEST_F(GlbFiles, FarFromTheOriginNothingIsLost) {
  Model model = NamedBalls();
  model.world_from_normalized = {50, {5e5, 4.5e6, 250}};
  const ExportableScene scene = Export(model);
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  EXPECT_EQ(glb.json["nodes"][1]["translation"], json({5e5, 4.5e6, 300.}))
      << "a round number, and the objects' own offsets are small";
  for (const json& node : ObjectNodes(glb)) {
    for (const double offset : node["translation"]) EXPECT_LT(std::abs(offset), 100);
  }
  const std::vector<Eigen::Vector3d> imported = ImportedVertices(glb);
  size_t at = 0;
  for (const ObjectInfo& object : scene.objects) {
    for (const Eigen::Vector3d& vertex : ExtractSurface(scene, object).vertices) {
      ASSERT_LT((imported[at++] - vertex).norm(), 1e-5);
    }
  }
}

TEST_F(GlbFiles, AFrameThatIsYUpAlreadyIsNotTurned) {
  ExportTransform transform;
  transform.up_axis = UpAxis::kY;
  transform.unit = LengthUnit::kCentimeter;
  const ExportableScene scene = Export(NamedBalls(), transform);
  const Glb glb = ReadGlb(folder_ / "objects/7_mug.glb");
  const json& root = glb.json["nodes"][0];
  EXPECT_FALSE(root.contains("rotation"));
  EXPECT_EQ(root["scale"], json({0.01, 0.01, 0.01})) << "glTF is in metres";
  EXPECT_EQ(root["extras"]["frame"], json::parse(ExportTransformJson(transform)));
  const ObjectSurface surface = ExtractSurface(scene, scene.objects[0]);
  const std::vector<Eigen::Vector3d> imported = ImportedVertices(glb);
  for (size_t v = 0; v < imported.size(); ++v) {
    EXPECT_LT((imported[v] - 0.01 * ZUpFromGltf(surface.vertices[v])).norm(), 1e-8);
  }
}

TEST_F(GlbFiles, ThePropertyTableSaysWhatFeaturesAre) {
  const ExportableScene scene = Export(NamedBalls());
  const Glb glb = ReadGlb(folder_ / "scene.glb");
  EXPECT_THAT(glb.json["extensionsUsed"].get<std::vector<std::string>>(),
              ElementsAre("EXT_mesh_features", "EXT_structural_metadata"));
  const json& metadata = glb.json["extensions"]["EXT_structural_metadata"];
  const json& table = metadata["propertyTables"][0];
  EXPECT_EQ(table["count"], 2);
  const json& properties = metadata["schema"]["classes"][table["class"]]["properties"];
  EXPECT_EQ(properties["id"]["componentType"], "UINT16");
  EXPECT_EQ(properties["name"]["type"], "STRING");
  EXPECT_EQ(properties["confidence"]["componentType"], "FLOAT64");
  EXPECT_EQ(properties["cells"]["componentType"], "UINT32");
  EXPECT_EQ(properties["color"]["componentType"], "UINT8");
  EXPECT_EQ(properties.size(), table["properties"].size());

  EXPECT_THAT(ReadColumn<uint16_t>(glb, "id"), ElementsAre(7, 8));
  const std::vector<char> text = ReadColumn<char>(glb, "name");
  const std::vector<uint32_t> offsets = ReadColumn<uint32_t>(glb, "name", "stringOffsets");
  EXPECT_THAT(offsets, ElementsAre(0, 3, text.size()));
  EXPECT_EQ(std::string(text.begin(), text.end()), "mug" + kCleanName);
  EXPECT_THAT(ReadColumn<double>(glb, "confidence"),
              ElementsAre(scene.objects[0].confidence, scene.objects[1].confidence));
  EXPECT_THAT(ReadColumn<double>(glb, "volume"),
              ElementsAre(scene.objects[0].volume, scene.objects[1].volume));
  EXPECT_THAT(ReadColumn<uint32_t>(glb, "cells"),
              ElementsAre(scene.objects[0].cells.size(), scene.objects[1].cells.size()));
  EXPECT_EQ(ReadColumn<uint8_t>(glb, "color").size(), 6u);

  // The extension asks for 8 bytes, of the file's beginning.
  EXPECT_EQ(glb.binary_begins % 8, 0u);
  for (const json& view : glb.json["bufferViews"]) {
    EXPECT_EQ(view["byteOffset"].get<size_t>() % (view.contains("target") ? 4 : 8), 0u);
  }
  for (const json& mesh : glb.json["meshes"]) {
    const json& feature = mesh["primitives"][0]["extensions"]["EXT_mesh_features"]["featureIds"][0];
    EXPECT_EQ(feature["attribute"], 0);
    EXPECT_EQ(feature["propertyTable"], 0);
    EXPECT_EQ(feature["featureCount"], 1);
  }
}

// One object with a texture, one without.
TEST_F(GlbFiles, TexturesHaveMaterialsOfTheirOwn) {
  const ExportableScene scene = MakeExportableScene(NamedBalls());
  GlbFile file({}, "test");
  std::vector<ObjectSurface> surfaces;
  for (const ObjectInfo& object : scene.objects) {
    surfaces.push_back(ExtractSurface(scene, object));
  }
  const SurfaceTexture texture = TestTexture(surfaces[1]);
  file.Add(scene.objects[0], surfaces[0], MakeLocalMesh(surfaces[0]));
  file.Add(scene.objects[1], surfaces[1], MakeLocalMesh(surfaces[1]), &texture);
  file.Write(folder_ / "both.glb");
  const Glb glb = ReadGlb(folder_ / "both.glb");
  const auto primitive = [&](int k) { return glb.json["meshes"][k]["primitives"][0]; };
  EXPECT_TRUE(primitive(0)["attributes"].contains("COLOR_0"));
  EXPECT_FALSE(primitive(0)["attributes"].contains("TEXCOORD_0"));
  EXPECT_EQ(glb.json["materials"][primitive(0)["material"].get<int>()]["name"], "vertex colours");

  const json attributes = primitive(1)["attributes"];
  EXPECT_FALSE(attributes.contains("COLOR_0")) << "it would be multiplied with the texture";
  const auto coordinates = ReadAccessor<float>(glb, attributes["TEXCOORD_0"]);
  const auto positions = ReadAccessor<float>(glb, attributes["POSITION"]);
  const auto colors = ReadAccessor<uint16_t>(glb, attributes["_COLOR"]);
  const LocalMesh mesh = MakeLocalMesh(surfaces[1]);
  ASSERT_EQ(coordinates.size(), 2 * texture.coordinates.size());
  ASSERT_EQ(positions.size(), 3 * texture.coordinates.size());
  ASSERT_EQ(colors.size(), 4 * texture.coordinates.size());
  for (size_t i = 0; i < texture.coordinates.size(); ++i) {
    const uint32_t v = texture.vertex_of[i];
    for (int c = 0; c < 2; ++c) EXPECT_EQ(coordinates[2 * i + c], texture.coordinates[i][c]);
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(positions[3 * i + c], mesh.positions[v][c]);
      EXPECT_EQ(colors[4 * i + c],
                std::lround(65535 * LinearLight(surfaces[1].vertex_color[v][c])));
    }
  }
  const auto indices = ReadAccessor<uint32_t>(glb, primitive(1)["indices"]);
  ASSERT_EQ(indices.size(), 3 * texture.triangles.size());
  for (size_t i = 0; i < indices.size(); ++i) {
    ASSERT_EQ(indices[i], texture.triangles[i / 3][i % 3]);
  }

  const json material = glb.json["materials"][primitive(1)["material"].get<int>()];
  const json used =
      glb.json["textures"]
              [material["pbrMetallicRoughness"]["baseColorTexture"]["index"].get<int>()];
  const json image = glb.json["images"][used["source"].get<int>()];
  EXPECT_EQ(image["mimeType"], "image/png");
  EXPECT_EQ(ViewBytes(glb, image["bufferView"]), texture.file);
}

TEST_F(GlbFiles, SameSceneSameBytes) {
  const auto bytes = [&] {
    Export(NamedBalls());
    std::ifstream in(folder_ / "scene.glb", std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  const std::string first = bytes();
  EXPECT_EQ(bytes(), first);
}

TEST_F(GlbFiles, ASceneWithoutObjectsHasNoFile) {
  Model model = TouchingBalls(200);
  model.foam.raw_density.assign(200, -10.f);
  EXPECT_TRUE(ExportSurfaces(MakeExportableScene(model), folder_).empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace semfoam
