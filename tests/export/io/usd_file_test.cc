// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/usd_file.h"

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/object_selection.h"
#include "export/scene/object_surface.h"
#include "foam/image/srgb.h"

#include <array>
#include <cmath>
#include <fstream>
#include <map>

#include "tests/export/io/read_usda.h"
#include "tests/export/io/test_texture.h"
#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

class UsdFiles : public TemporaryFolderTest {
 protected:
  json Export(const ExportableScene& scene) {
    SurfaceExportOptions options;
    options.method = SurfaceMethod::kCells;
    options.om = options.ply = options.obj = options.glb = false;
    options.creator = "the \"test\" \\ 1";
    const std::vector<WrittenFile> files = ExportSurfaces(scene, folder_, options);
    EXPECT_EQ(files.size(), 1u);
    EXPECT_EQ(files.front().path, "scene.usda");
    EXPECT_EQ(files.front().format, "usda");
    return UsdaReader::Read(folder_ / "scene.usda");
  }
};

ExportableScene Scene(const std::vector<std::string>& names,
                      const Similarity& world_from_normalized = {},
                      const ExportTransform& transform = {}) {
  Model model = TouchingBalls(800);
  for (size_t k = 0; k < names.size(); ++k) model.labels[k].name = names[k];
  model.world_from_normalized = world_from_normalized;
  ExportableSceneOptions options;
  options.transform = transform;
  return MakeExportableScene(model, options);
}

std::vector<std::string> ChildNames(const json& prim) {
  std::vector<std::string> names;
  for (const auto& [name, child] : prim["children"].items()) names.push_back(name);
  return names;
}

TEST_F(UsdFiles, TheStageSaysItsFrame) {
  const json stage = Export(Scene({}));
  EXPECT_EQ(stage["metadata"]["defaultPrim"], "scene");
  EXPECT_EQ(stage["metadata"]["upAxis"], "Z");
  EXPECT_EQ(stage["metadata"]["metersPerUnit"], 1);
  EXPECT_EQ(stage["metadata"]["customLayerData"]["creator"], "the \"test\" \\ 1");
  EXPECT_EQ(stage["metadata"]["customLayerData"]["frame"], ExportTransformJson({}));
  EXPECT_EQ(stage["children"]["scene"]["type"], "Xform");

  ExportTransform transform;
  transform.up_axis = UpAxis::kY;
  transform.unit = LengthUnit::kFoot;
  const json turned = Export(Scene({}, {}, transform));
  EXPECT_EQ(turned["metadata"]["upAxis"], "Y");
  EXPECT_EQ(turned["metadata"]["metersPerUnit"], 0.3048);
  EXPECT_EQ(turned["metadata"]["customLayerData"]["frame"], ExportTransformJson(transform));
}

TEST_F(UsdFiles, OneXformPerObjectWithItsMeaning) {
  const ExportableScene scene = Scene({"mug", "M\xC3\xBCtze \"blue\"\n\\"});
  const json stage = Export(scene);
  const json& objects = stage["children"]["scene"]["children"];
  EXPECT_THAT(ChildNames(stage["children"]["scene"]),
              UnorderedElementsAre("mug", "M_tze__blue___"));
  const json& hat = objects["M_tze__blue___"];
  const std::string name = "M\xC3\xBCtze \"blue\" \\";
  EXPECT_EQ(hat["type"], "Xform");
  EXPECT_EQ(hat["metadata"]["apiSchemas"], json({"SemanticsLabelsAPI:class"}));
  EXPECT_EQ(hat["metadata"]["customData"]["id"], 8);
  EXPECT_EQ(hat["metadata"]["customData"]["name"], name);
  EXPECT_EQ(hat["metadata"]["customData"]["confidence"], scene.objects[1].confidence);
  EXPECT_EQ(hat["metadata"]["displayName"], name);
  EXPECT_EQ(hat["properties"]["semantics:labels:class"]["type"], "token[]");
  EXPECT_EQ(hat["properties"]["semantics:labels:class"]["value"], json::array({name}));
  EXPECT_EQ(hat["children"]["surface"]["type"], "Mesh");
  EXPECT_FALSE(hat["children"].contains("volume")) << "there is no .vdb";
}

TEST_F(UsdFiles, MeshesHoldTheSurface) {
  const ExportableScene scene = Scene({"mug", "hat"}, {50, {5e5, 4.5e6, 250}});
  const json stage = Export(scene);
  for (const ObjectInfo& object : scene.objects) {
    const ObjectSurface surface = ExtractSurface(scene, object);
    const json& p =
        stage["children"]["scene"]["children"][object.name]["children"]["surface"]["properties"];
    const size_t vertices = surface.vertices.size();
    const json& points = p["points"]["value"];
    const json& normals = p["normals"]["value"];
    const json& colors = p["primvars:displayColor"]["value"];
    ASSERT_EQ(points.size(), vertices);
    ASSERT_EQ(normals.size(), vertices);
    ASSERT_EQ(colors.size(), vertices);
    ASSERT_EQ(p["primvars:confidence"]["value"].size(), vertices);
    for (const char* per_vertex : {"normals", "primvars:displayColor", "primvars:confidence"}) {
      EXPECT_EQ(p[per_vertex]["metadata"]["interpolation"], "vertex");
    }
    EXPECT_EQ(p["points"]["type"], "point3f[]");
    EXPECT_EQ(p["primvars:label"]["value"], object.id);
    EXPECT_EQ(p["orientation"]["value"], "rightHanded");
    EXPECT_EQ(p["subdivisionScheme"]["value"], "none");
    EXPECT_EQ(p["xformOpOrder"]["value"], json({"xformOp:translate"}));
    EXPECT_EQ(p["xformOp:translate"]["type"], "double3");
    const json& t = p["xformOp:translate"]["value"];
    const Eigen::Vector3d origin(t[0], t[1], t[2]);
    Eigen::AlignedBox3f box;
    for (size_t v = 0; v < vertices; ++v) {
      const Eigen::Vector3f x(points[v][0], points[v][1], points[v][2]);
      box.extend(x);
      EXPECT_LT((x.cast<double>() + origin - surface.vertices[v]).norm(), 1e-5);
      const Eigen::Vector3f n(normals[v][0], normals[v][1], normals[v][2]);
      EXPECT_NEAR(n.norm(), 1, 1e-6f);
      EXPECT_EQ(p["primvars:confidence"]["value"][v].get<float>(), surface.vertex_confidence[v]);
      for (int c = 0; c < 3; ++c) {
        const double display = DisplayFromLinear(colors[v][c].get<double>());
        EXPECT_EQ(std::lround(255 * display), surface.vertex_color[v][c]);
      }
    }
    const json& extent = p["extent"]["value"];
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(extent[0][a].get<float>(), box.min()[a]);
      EXPECT_EQ(extent[1][a].get<float>(), box.max()[a]);
    }
    const json& counts = p["faceVertexCounts"]["value"];
    const json& indices = p["faceVertexIndices"]["value"];
    ASSERT_EQ(counts.size(), surface.triangles.size());
    ASSERT_EQ(indices.size(), 3 * surface.triangles.size());
    for (const json& count : counts) ASSERT_EQ(count, 3);
    for (size_t k = 0; k < indices.size(); ++k) {
      ASSERT_EQ(indices[k], surface.triangles[k / 3][k % 3]);
    }
  }
}

// The fields of a prim's volume: name -> {grid, type, class}, "" where there is none.
using Fields = std::map<std::string, std::array<std::string, 3>>;
Fields FieldsOf(const json& object) {
  Fields fields;
  const json& volume = object["children"]["volume"];
  EXPECT_EQ(volume["type"], "Volume");
  EXPECT_EQ(volume["properties"]["visibility"]["value"], "invisible");
  for (const auto& [name, asset] : volume["children"].items()) {
    EXPECT_EQ(volume["properties"]["field:" + name]["value"], "/scene/mug/volume/" + name);
    EXPECT_EQ(asset["type"], "OpenVDBAsset");
    const json& p = asset["properties"];
    EXPECT_EQ(p["filePath"]["value"], "./objects/7_mug.vdb");
    fields[name] = {p["fieldName"]["value"],
                    p["fieldDataType"]["value"],
                    p.contains("fieldClass") ? p["fieldClass"]["value"] : ""};
  }
  EXPECT_EQ(volume["properties"].size(), fields.size() + 1);
  return fields;
}

TEST_F(UsdFiles, ATextureIsTheColourOfAPreviewSurface) {
  const ExportableScene scene = Scene({"mug", "hat"});
  const ObjectSurface surface = ExtractSurface(scene, scene.objects[0]);
  const SurfaceTexture texture = TestTexture(surface);
  const LocalMesh mesh = MakeLocalMesh(surface);
  UsdFile file(folder_ / "scene.usda", {}, "test");
  file.Add(scene.objects[0], {surface, mesh, &texture, "objects/7_mug.png"}, "", {});
  file.Finish();
  const json stage = UsdaReader::Read(folder_ / "scene.usda");
  const json& mug = stage["children"]["scene"]["children"]["mug"]["children"];
  EXPECT_EQ(mug["surface"]["metadata"]["apiSchemas"], json({"MaterialBindingAPI"}));
  const json& p = mug["surface"]["properties"];
  EXPECT_EQ(p["material:binding"]["value"], "/scene/mug/material");
  EXPECT_EQ(p["points"]["value"].size(), surface.vertices.size()) << "it stays closed";
  EXPECT_EQ(p["primvars:displayColor"]["value"].size(), surface.vertices.size());
  EXPECT_EQ(p["primvars:st"]["type"], "texCoord2f[]");
  EXPECT_EQ(p["primvars:st"]["metadata"]["interpolation"], "faceVarying");
  const json& st = p["primvars:st"]["value"];
  ASSERT_EQ(st.size(), texture.coordinates.size());
  for (size_t i = 0; i < st.size(); ++i) {
    EXPECT_EQ(st[i][0].get<float>(), texture.coordinates[i].x());
    EXPECT_EQ(st[i][1].get<float>(), 1 - texture.coordinates[i].y());
  }
  const json& indices = p["primvars:st:indices"]["value"];
  ASSERT_EQ(indices.size(), 3 * texture.triangles.size());
  for (size_t i = 0; i < indices.size(); ++i) {
    ASSERT_EQ(indices[i], texture.triangles[i / 3][i % 3]);
  }

  const json& material = mug["material"];
  EXPECT_EQ(material["type"], "Material");
  EXPECT_EQ(material["properties"]["outputs:surface.connect"]["value"],
            "/scene/mug/material/shader.outputs:surface");
  const json& nodes = material["children"];
  EXPECT_EQ(nodes["shader"]["properties"]["info:id"]["value"], "UsdPreviewSurface");
  EXPECT_EQ(nodes["shader"]["properties"]["inputs:diffuseColor.connect"]["value"],
            "/scene/mug/material/texture.outputs:rgb");
  EXPECT_EQ(nodes["texture"]["properties"]["info:id"]["value"], "UsdUVTexture");
  EXPECT_EQ(nodes["texture"]["properties"]["inputs:file"]["value"], "./objects/7_mug.png");
  EXPECT_EQ(nodes["texture"]["properties"]["inputs:st.connect"]["value"],
            "/scene/mug/material/coordinates.outputs:result");
  EXPECT_EQ(nodes["coordinates"]["properties"]["inputs:varname"]["value"], "st");
}

TEST_F(UsdFiles, AVolumeThatIsThereIsNamedWithAllItsFields) {
  const ExportableScene scene = Scene({"mug", "hat"});
  VolumeExportOptions options;
  options.max_resolution = 16;
  options.objects = FilterObjects(scene, {"mug"});
  ExportVolumes(scene, folder_, options);
  json objects = Export(scene)["children"]["scene"]["children"];
  EXPECT_FALSE(objects["hat"]["children"].contains("volume"));
  const Fields plain = {{"density", {"density", "float", "fogVolume"}},
                        {"color", {"color", "float3", ""}},
                        {"label", {"label", "float", ""}},
                        {"confidence", {"confidence", "float", ""}},
                        {"surface", {"surface", "float", "levelSet"}}};
  EXPECT_EQ(FieldsOf(objects["mug"]), plain);
  const json& color = objects["mug"]["children"]["volume"]["children"]["color"];
  EXPECT_EQ(color["properties"]["vectorDataRoleHint"]["value"], "Color");

  // Other names, even misleading ones, and no grid of labels.
  options.grid_names = {"surface", "Cd", "id", "sure", "density"};
  options.label_grid_type = LabelGridType::kInt32;
  ExportVolumes(scene, folder_, options);
  objects = Export(scene)["children"]["scene"]["children"];
  EXPECT_EQ(FieldsOf(objects["mug"]),
            (Fields{{"density", {"surface", "float", "fogVolume"}},
                    {"color", {"Cd", "float3", ""}},
                    {"confidence", {"sure", "float", ""}},
                    {"surface", {"density", "float", "levelSet"}}}));
}

TEST_F(UsdFiles, AVolumeThatCannotBeReadIsLeftOutWithAWarning) {
  std::filesystem::create_directories(folder_ / "objects");
  std::ofstream(folder_ / "objects/7_mug.vdb") << "no volume at all";
  SurfaceExportOptions options;
  options.om = options.ply = options.obj = options.glb = false;
  const std::vector<WrittenFile> files = ExportSurfaces(Scene({"mug", "hat"}), folder_, options);
  ASSERT_EQ(files.size(), 1u);
  EXPECT_THAT(files[0].warning, HasSubstr("7_mug.vdb: is no volume that can be read"));
  const json stage = UsdaReader::Read(folder_ / "scene.usda");
  EXPECT_FALSE(stage["children"]["scene"]["children"]["mug"]["children"].contains("volume"));
}

TEST_F(UsdFiles, PrimNamesAreIdentifiersAndUnique) {
  EXPECT_THAT(ChildNames(Export(Scene({"3d-print", "3d print"}))["children"]["scene"]),
              UnorderedElementsAre("_3d_print", "_3d_print_8"));
  EXPECT_THAT(ChildNames(Export(Scene({"\xE6\x9D\xAF", "x"}))["children"]["scene"]),
              UnorderedElementsAre("label_7", "x"));
}

TEST_F(UsdFiles, TheReaderOfThisTestIsStrict) {
  for (const char* bad : {"#usda 1.0\ndef Xform \"a\" {",
                          "#usda 1.0\ndef Xform \"1a\" {}",
                          "#usda 1.0\ndef Xform \"a\" { int x = }",
                          "#usda 1.0\ndef Xform \"a\" { int[] x = [1 2] }",
                          "#usda 1.0\ndef Xform \"a\" {} def Xform \"a\" {}",
                          "#usda 1.0\n} "}) {
    std::ofstream(folder_ / "bad.usda") << bad;
    EXPECT_THROW(UsdaReader::Read(folder_ / "bad.usda"), std::runtime_error) << bad;
  }
}

}  // namespace
}  // namespace semfoam
