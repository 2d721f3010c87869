// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/gltf_labels.h"

#include "foam/util/error.h"

#include <fstream>

#include "tests/export/io/read_glb.h"
#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr SurfaceLabel kMug{LabelId{7}, 0.5f}, kOther{LabelId{8}, 0.25f}, kNone{};
const std::vector<Label> kLabels = {{LabelId{7}, MaskId{7}, "my mug"}};

// A turned and moved node with two triangles, a strip of two and a point, below it a node with the
// same mesh; an image; four vertices, of which colours are kept too.
class GltfLabelsTest : public TemporaryFolderTest {
 protected:
  GltfLabelsTest() {
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f}) {
      AppendBinary(x, &binary_);
    }
    for (const int color : {255, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}) {
      AppendBinary(static_cast<uint8_t>(color), &binary_);
    }
    for (const int corner : {0, 1, 2, 0, 2, 3})
      AppendBinary(static_cast<uint8_t>(corner), &binary_);
    for (const int corner : {0, 1, 3, 2}) AppendBinary(static_cast<uint16_t>(corner), &binary_);
    binary_ += "a PNG";
    json_ = ordered_json::parse(R"({
      "zone": 1.50, "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
      "nodes": [{"name": "top", "mesh": 0, "translation": [10, 0, 0], "scale": [2, 2, 2],
                 "rotation": [0, 0, 1, 0], "children": [1]}, {"mesh": 0}],
      "meshes": [{"name": "merged", "primitives": [
        {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0, "extras": 3},
        {"attributes": {"POSITION": 0}, "mode": 0},
        {"attributes": {"POSITION": 0}, "indices": 3, "mode": 5}]}],
      "materials": [{"name": "paint"}],
      "images": [{"bufferView": 3, "mimeType": "image/png"}],
      "buffers": [{"byteLength": 83}],
      "bufferViews": [{"buffer": 0, "byteLength": 64},
        {"buffer": 0, "byteOffset": 64, "byteLength": 6},
        {"buffer": 0, "byteOffset": 70, "byteLength": 8},
        {"buffer": 0, "byteOffset": 78, "byteLength": 5}],
      "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 0, "byteOffset": 48, "componentType": 5121, "normalized": true, "count": 4,
         "type": "VEC4"},
        {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5123, "count": 4, "type": "SCALAR"}]
    })");
  }

  fs::path Write(const std::string& name, const std::string& bytes) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  GltfMesh Read() { return GltfMesh(Write("in.glb", GlbOf(json_.dump(), binary_))); }
  std::string Refusal(const std::string& bytes) {
    try {
      GltfMesh(Write("in.glb", bytes));
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  std::string Refusal() { return Refusal(GlbOf(json_.dump(), binary_)); }

  ordered_json json_;
  std::string binary_;
};

TEST_F(GltfLabelsTest, ReadsTheTrianglesOfAllNodes) {
  const GltfMesh gltf = Read();
  const PolygonMesh& mesh = gltf.mesh();
  ASSERT_EQ(mesh.vertices.size(), 8u);
  ASSERT_EQ(mesh.NumFaces(), 8u);
  // Turned by 180 degrees about z.
  EXPECT_LT((mesh.vertices[0] - Eigen::Vector3d(10, 0, 0)).norm(), 1e-12);
  EXPECT_LT((mesh.vertices[1] - Eigen::Vector3d(8, 0, 0)).norm(), 1e-12);
  EXPECT_LT((mesh.vertices[7] - Eigen::Vector3d(10, -2, 0)).norm(), 1e-12);
  EXPECT_THAT(mesh.Face(1), ElementsAre(0, 2, 3));
  EXPECT_THAT(mesh.Face(2), ElementsAre(0, 1, 3));
  EXPECT_THAT(mesh.Face(3), ElementsAre(1, 2, 3));
  EXPECT_THAT(mesh.Face(7), ElementsAre(5, 6, 7));
  for (size_t f = 0; f < 8; ++f) EXPECT_GT(mesh.FaceArea(f).z(), 0) << "one side is up";
}

// Integers as coordinates, and a fan without indices.
TEST_F(GltfLabelsTest, ReadsOtherTypes) {
  std::string binary;
  for (const int x : {0, 0, 0, 0, 127, 0, 0, 0, 127, 127, 0, 0, 0, 127, 0, 0}) {
    AppendBinary(static_cast<int8_t>(x), &binary);
  }
  binary_ = binary;
  json_ = ordered_json::parse(R"({"asset": {"version": "2.0"},
    "nodes": [{"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}],
    "buffers": [{"byteLength": 16}],
    "bufferViews": [{"buffer": 0, "byteLength": 16, "byteStride": 4}],
    "accessors": [{"bufferView": 0, "componentType": 5120, "normalized": true, "count": 4,
                   "type": "VEC3"}]})");
  const GltfMesh gltf = Read();
  ASSERT_EQ(gltf.mesh().NumFaces(), 2u);
  EXPECT_EQ(gltf.mesh().vertices[2], Eigen::Vector3d(6, 7, 7));
  Eigen::Vector3d area = gltf.mesh().FaceArea(0) + gltf.mesh().FaceArea(1);
  EXPECT_NEAR(area.z(), 1, 1e-12);
}

TEST_F(GltfLabelsTest, LabelsBecomeMeshesAndAllElseStays) {
  // The two triangles of the first primitive differ, the strip is of one label.
  Read().Write(
      folder_ / "out.glb", kLabels, {kMug, kOther, kMug, kMug, kOther, kOther, kOther, kNone});
  const Glb glb = ReadGlb(folder_ / "out.glb");
  EXPECT_EQ(glb.binary.substr(0, 83), binary_.substr(0, 83));
  const auto& in = json_;
  for (const char* key : {"zone", "scenes", "materials", "images"}) {
    EXPECT_EQ(glb.json[key], nlohmann::json::parse(in[key].dump())) << key;
  }
  for (const char* key : {"accessors", "bufferViews"}) {
    for (size_t k = 0; k < in[key].size(); ++k) {
      EXPECT_EQ(glb.json[key][k], nlohmann::json::parse(in[key][k].dump())) << key;
    }
  }
  ASSERT_EQ(glb.json["nodes"].size(), 2u + 2 + 2);
  EXPECT_EQ(glb.json["nodes"][0]["children"], nlohmann::json({1, 2, 3}));
  EXPECT_EQ(glb.json["nodes"][0]["name"], "top");
  EXPECT_EQ(glb.json["nodes"][2],
            nlohmann::json({{"name", "my mug"},
                            {"mesh", glb.json["nodes"][2]["mesh"]},
                            {"extras", {{"label", 7}, {"name", "my mug"}, {"confidence", 0.5}}}}));
  EXPECT_EQ(glb.json["nodes"][3]["name"], "label_8");
  EXPECT_EQ(glb.json["nodes"][4]["name"], "unlabelled");
  const auto primitives = [&](int node) {
    return glb.json["meshes"][glb.json["nodes"][node]["mesh"].get<int>()]["primitives"];
  };
  // The points stay where they were.
  EXPECT_EQ(primitives(0),
            nlohmann::json::array({{{"attributes", {{"POSITION", 0}}}, {"mode", 0}}}));
  ASSERT_EQ(primitives(2).size(), 2u);
  EXPECT_EQ(primitives(2)[0]["attributes"], nlohmann::json({{"POSITION", 0}, {"COLOR_0", 1}}));
  EXPECT_EQ(primitives(2)[0]["material"], 0);
  EXPECT_EQ(primitives(2)[0]["extras"], 3);
  EXPECT_THAT(ReadAccessor<uint16_t>(glb, primitives(2)[0]["indices"]), ElementsAre(0, 1, 2));
  EXPECT_EQ(primitives(2)[1],
            nlohmann::json({{"attributes", {{"POSITION", 0}}}, {"indices", 3}, {"mode", 5}}))
      << "a primitive of one label is as it was";
  EXPECT_THAT(ReadAccessor<uint16_t>(glb, primitives(3)[0]["indices"]), ElementsAre(0, 2, 3));
  EXPECT_THAT(ReadAccessor<uint16_t>(glb, primitives(4)[0]["indices"]), ElementsAre(1, 2, 3));

  // What was written has the same triangles.
  const GltfMesh again(folder_ / "out.glb");
  EXPECT_EQ(again.mesh().NumFaces(), 8u);
}

TEST_F(GltfLabelsTest, BuffersAndImagesOfAGltfComeAlong) {
  json_["buffers"][0]["uri"] = "tex/my%20data.bin";
  json_["images"].push_back({{"uri", "tex/a.png"}});
  json_["images"].push_back({{"uri", "../outside.png"}});
  Write("in/tex/my data.bin", binary_);
  Write("in/tex/a.png", "png");
  Write("outside.png", "outside");
  const GltfMesh gltf(Write("in/in.gltf", json_.dump()));
  CopyFiles(gltf.Companions(folder_ / "out"));
  gltf.Write(
      folder_ / "out/in.gltf", kLabels, {kMug, kOther, kMug, kMug, kOther, kOther, kOther, kNone});
  std::ifstream bin(folder_ / "out/tex/my data.bin", std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(bin), {}), binary_);
  EXPECT_TRUE(fs::exists(folder_ / "out/tex/a.png"));
  const GltfMesh again(folder_ / "out/in.gltf");
  EXPECT_EQ(again.mesh().vertices.size(), 8u * 2);
  EXPECT_EQ(again.mesh().NumFaces(), 8u);
}

// The numbers of our own files are those of the frame, whatever turns them upright for importers.
TEST_F(GltfLabelsTest, TheRootOfOurOwnFilesIsNoTurn) {
  json_["nodes"][0]["extras"] = {{"frame", ordered_json::object()}};
  EXPECT_EQ(Read().mesh().vertices[1], Eigen::Vector3d(1, 0, 0));
}

TEST_F(GltfLabelsTest, RefusesWhatItCannotKeep) {
  const ordered_json whole = json_;
  const auto refusal_with = [&](const char* pointer, const ordered_json& value) {
    json_ = whole;
    json_[ordered_json::json_pointer(pointer)] = value;
    return Refusal();
  };
  EXPECT_THAT(refusal_with("/extensionsUsed", {"KHR_draco_mesh_compression"}),
              HasSubstr("in.glb: is compressed (KHR_draco_mesh_compression)"));
  EXPECT_THAT(refusal_with("/extensionsRequired", {"EXT_meshopt_compression"}),
              HasSubstr("is compressed (EXT_meshopt_compression)"));
  EXPECT_THAT(refusal_with("/extensionsUsed", {"EXT_mesh_gpu_instancing"}),
              HasSubstr("has instances"));
  EXPECT_THAT(refusal_with("/nodes/1/skin", 0), HasSubstr("nodes[1] moves its vertices"));
  EXPECT_THAT(refusal_with("/accessors/0/sparse", ordered_json::object()),
              HasSubstr("accessors[0] is sparse"));
  EXPECT_THAT(refusal_with("/asset/version", "1.0"), HasSubstr("is no glTF of version 2.0"));
  EXPECT_THAT(
      refusal_with("/meshes/0/primitives", {{{"attributes", {{"POSITION", 0}}}, {"mode", 0}}}),
      HasSubstr("has no triangles"));
}

TEST_F(GltfLabelsTest, RefusesDamagedFilesWithOneSentence) {
  const ordered_json whole = json_;
  struct Damage {
    const char* pointer;
    ordered_json value;
    const char* kind;
  };
  const std::vector<Damage> damages = {
      {"/accessors/0/count", 6, "accessors[0] leaves its buffer view of 64 bytes"},
      {"/accessors/0/count", uint64_t{1} << 61, "accessors[0] has a count that is none"},
      {"/accessors/0/count", int64_t{1} << 51, "accessors[0] leaves its buffer view"},
      {"/accessors/0/count", 3, "has the index 3, but 3 vertices"},
      {"/accessors/0/type", "VEC2", "accessors[0] is no VEC3"},
      {"/accessors/2/count", 5, "has 5 corners"},
      {"/accessors/2/componentType", 7, "componentType that is none"},
      {"/accessors/2/componentType", 5120, "indices of another type"},
      {"/accessors/2/bufferView", 9, "is 9, which the list bufferViews does not have"},
      {"/bufferViews/1/byteLength", 100, "bufferViews[1] leaves its buffer of 83 bytes"},
      {"/bufferViews/0/byteStride", 4, "accessors[0] leaves"},
      {"/buffers/0/byteLength", 1000, "buffers[0] has 84 bytes of 1000"},
      {"/buffers", ordered_json::array(), "bufferViews[0] has a buffer that is none"},
      {"/buffers/0/uri", "../a.bin", "is not in its folder"},
      {"/buffers/0/uri", "data:x;base64,!", "no base64"},
      {"/nodes/0/children", {1, 1}, "nodes[1] has two parents"},
      {"/nodes/1/children", {0}, "its own ancestor"},
      {"/nodes/0/children", {7}, "nodes[0] has a child"},
      {"/nodes/0/translation", {1, 2}, "nodes[0] has a translation"},
      {"/nodes/0/mesh", -1, "nodes[0] has a mesh"},
      {"/nodes", 3, "nodes is no list"},
      {"/meshes/0/primitives/0", 3, "is no object"}};
  for (const Damage& damage : damages) {
    json_ = whole;
    json_[ordered_json::json_pointer(damage.pointer)] = damage.value;
    EXPECT_THAT(Refusal(), HasSubstr(damage.kind)) << damage.pointer;
  }
  json_ = whole;
  const std::string glb = GlbOf(json_.dump(), binary_);
  EXPECT_THAT(Refusal(glb.substr(0, glb.size() - 4)), HasSubstr("is the copy complete"));
  EXPECT_THAT(Refusal("glTF"), HasSubstr("is no binary glTF of version 2"));
  EXPECT_THAT(Refusal("{}"), HasSubstr("is no glTF of version 2.0"));
  EXPECT_THAT(Refusal("{"), HasSubstr("in.glb: "));
}

// Of cuts and changed bytes, a mesh or a refusal; what is read can be written.
TEST_F(GltfLabelsTest, DamagedFilesAreReadOrRefused) {
  const std::string whole = GlbOf(json_.dump(), binary_);
  int refused = 0;
  for (size_t at = 0; at < whole.size(); at += 5) {
    for (const char byte : {'\0', '9', '\xff', '"', '-'}) {
      std::string bytes = whole;
      bytes[at] = byte;
      const fs::path path = Write("in.glb", bytes);
      try {
        const GltfMesh gltf(path);
        gltf.Write(folder_ / "out.glb", {}, std::vector<SurfaceLabel>(gltf.mesh().NumFaces()));
      } catch (const UserError& error) {
        EXPECT_THAT(error.what(), HasSubstr("in.glb: "));
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 400);
}

}  // namespace
}  // namespace semfoam
