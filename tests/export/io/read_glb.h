// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// A small reader of binary glTF: by the specification, not by our writer.
namespace semfoam {

struct Glb {
  nlohmann::json json;
  std::string binary;
  size_t binary_begins = 0;  // in the file
};

inline uint32_t WordAt(const std::string& bytes, size_t at) {
  uint32_t word = 0;
  EXPECT_LE(at + sizeof(word), bytes.size());
  if (at + sizeof(word) <= bytes.size()) std::memcpy(&word, bytes.data() + at, sizeof(word));
  return word;
}

inline Glb ReadGlb(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in.good()) << path;
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(WordAt(bytes, 4), 2u);
  EXPECT_EQ(WordAt(bytes, 8), bytes.size());
  const uint32_t text = WordAt(bytes, 12);
  EXPECT_EQ(text % 4, 0u);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  const size_t second = 20 + text;
  EXPECT_EQ(bytes.substr(second + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(second + 8 + WordAt(bytes, second), bytes.size());
  Glb glb;
  glb.json = nlohmann::json::parse(bytes.substr(20, text));
  glb.binary = bytes.substr(second + 8);
  glb.binary_begins = second + 8;
  EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
  return glb;
}

inline std::string ViewBytes(const Glb& glb, int view) {
  const nlohmann::json& v = glb.json["bufferViews"][view];
  return glb.binary.substr(v["byteOffset"], v["byteLength"]);
}

// The elements of an accessor, component by component, as they are stored.
template <typename T>
std::vector<T> ReadAccessor(const Glb& glb, int accessor) {
  const nlohmann::json& a = glb.json["accessors"][accessor];
  const nlohmann::json& view = glb.json["bufferViews"][a["bufferView"].get<int>()];
  const std::string bytes = ViewBytes(glb, a["bufferView"]);
  const std::string shape = a["type"];
  const size_t components = shape == "SCALAR" ? 1 : shape == "VEC2" ? 2 : shape == "VEC3" ? 3 : 4;
  EXPECT_EQ(a["componentType"],
            (std::is_same_v<T, float>      ? 5126
             : std::is_same_v<T, uint16_t> ? 5123
                                           : 5125));
  const size_t stride = view.value("byteStride", components * sizeof(T));
  std::vector<T> values(a["count"].get<size_t>() * components);
  for (size_t k = 0; k < values.size(); ++k) {
    const size_t at =
        a["byteOffset"].get<size_t>() + k / components * stride + k % components * sizeof(T);
    EXPECT_LE(at + sizeof(T), bytes.size());
    if (at + sizeof(T) > bytes.size()) return {};
    std::memcpy(&values[k], bytes.data() + at, sizeof(T));
  }
  return values;
}

// A property table's column of numbers.
template <typename T>
std::vector<T> ReadColumn(const Glb& glb,
                          const std::string& property,
                          const char* part = "values") {
  const nlohmann::json& table =
      glb.json["extensions"]["EXT_structural_metadata"]["propertyTables"][0];
  const std::string bytes = ViewBytes(glb, table["properties"][property][part]);
  EXPECT_EQ(bytes.size() % sizeof(T), 0u);
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

// The transform of a node of a tree, from its own frame to glTF's, in double.
inline Eigen::Affine3d GltfFromNode(const Glb& glb, size_t node) {
  const nlohmann::json& n = glb.json["nodes"][node];
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  if (n.contains("translation")) {
    const auto& t = n["translation"];
    transform.translate(Eigen::Vector3d(t[0], t[1], t[2]));
  }
  if (n.contains("rotation")) {
    const auto& r = n["rotation"];
    transform.rotate(Eigen::Quaterniond(r[3], r[0], r[1], r[2]));
  }
  if (n.contains("scale")) {
    const auto& s = n["scale"];
    transform.scale(Eigen::Vector3d(s[0], s[1], s[2]));
  }
  for (size_t parent = 0; parent < glb.json["nodes"].size(); ++parent) {
    const nlohmann::json& p = glb.json["nodes"][parent];
    if (!p.contains("children")) continue;
    for (const auto& child : p["children"]) {
      if (child == node) return GltfFromNode(glb, parent) * transform;
    }
  }
  return transform;
}

// Where a z-up program that imports glTF puts a point of it.
inline Eigen::Vector3d ZUpFromGltf(const Eigen::Vector3d& x) { return {x.x(), -x.z(), x.y()}; }

// The vertices of all nodes with a mesh, in order, as such a program shows them.
inline std::vector<Eigen::Vector3d> ImportedVertices(const Glb& glb) {
  std::vector<Eigen::Vector3d> vertices;
  for (size_t node = 0; node < glb.json["nodes"].size(); ++node) {
    if (!glb.json["nodes"][node].contains("mesh")) continue;
    const int mesh = glb.json["nodes"][node]["mesh"];
    const auto& primitive = glb.json["meshes"][mesh]["primitives"][0];
    const std::vector<float> positions =
        ReadAccessor<float>(glb, primitive["attributes"]["POSITION"]);
    const Eigen::Affine3d gltf_from_node = GltfFromNode(glb, node);
    for (size_t k = 0; k < positions.size(); k += 3) {
      const Eigen::Vector3d x(positions[k], positions[k + 1], positions[k + 2]);
      vertices.push_back(ZUpFromGltf(gltf_from_node * x));
    }
  }
  return vertices;
}

}  // namespace semfoam
