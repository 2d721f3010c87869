// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/glb_file.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using Json = nlohmann::ordered_json;

// The numbers that glTF gives to types and uses.
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr uint32_t kMagic = 0x46546C67;        // "glTF"
constexpr uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr uint32_t kBinaryChunk = 0x004E4942;  // "BIN\0"

// What property tables ask of their columns, and all accessors are content with.
constexpr size_t kAlignment = 8;

// A vertex, interleaved.
constexpr uint64_t kPositionAt = 0;
constexpr uint64_t kNormalAt = 12;
constexpr uint64_t kColorAt = 24;
constexpr uint64_t kFeatureAt = 32;
constexpr uint64_t kConfidenceAt = 36;
constexpr uint64_t kVertexBytes = 40;

void Align(char with, std::string* bytes) {
  while (bytes->size() % kAlignment != 0) bytes->push_back(with);
}

template <typename Vector>
Json ToJson(const Vector& vector) {
  Json json = Json::array();
  for (const auto value : vector) json.push_back(value);
  return json;
}

// The JSON of a glTF file, and the binary that it speaks of, while they grow.
struct Document {
  Json json;
  std::string* binary;

  int AddView(uint64_t from, uint64_t length) {
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", from}, {"byteLength", length}});
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }

  // The bytes, aligned, as a view.
  int AddColumn(const std::string& bytes) {
    Align('\0', binary);
    const uint64_t from = binary->size();
    binary->append(bytes);
    return AddView(from, bytes.size());
  }

  int AddAccessor(int view, uint64_t offset, int type, const char* shape, uint64_t count) {
    json["accessors"].push_back({{"bufferView", view},
                                 {"byteOffset", offset},
                                 {"componentType", type},
                                 {"count", count},
                                 {"type", shape}});
    return static_cast<int>(json["accessors"].size()) - 1;
  }
};

// A number per row of a property table.
template <typename T, typename Rows, typename Value>
int AddNumbers(const Rows& rows, const Value& value, Document* document) {
  std::string bytes;
  for (const auto& row : rows) AppendBinary(static_cast<T>(value(row)), &bytes);
  return document->AddColumn(bytes);
}

}  // namespace

GlbFile::GlbFile(const ExportTransform& transform, std::string creator)
    : transform_(transform), creator_(std::move(creator)) {}

void GlbFile::Add(const ObjectInfo& object, const ObjectSurface& surface, const LocalMesh& mesh) {
  Node& node = nodes_.emplace_back();
  node.object = object;
  node.num_cells = object.cells.size();
  node.object.cells.clear();
  node.origin = mesh.origin;
  node.min_position = mesh.min_position;
  node.max_position = mesh.max_position;
  node.num_vertices = surface.vertices.size();
  node.num_indices = 3 * surface.triangles.size();
  Align('\0', &binary_);
  node.first_byte = binary_.size();
  // 2^24 rows are more than labels have ids.
  const float row = static_cast<float>(nodes_.size() - 1);
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    for (const float x : mesh.positions[v]) AppendBinary(x, &binary_);
    for (const float x : mesh.normals[v]) AppendBinary(x, &binary_);
    for (const uint8_t channel : surface.vertex_color[v]) {
      const float light = LinearLight(channel);
      AppendBinary(static_cast<uint16_t>(std::lround(65535 * light)), &binary_);
    }
    AppendBinary(uint16_t{65535}, &binary_);  // opaque
    AppendBinary(row, &binary_);
    AppendBinary(surface.vertex_confidence[v], &binary_);
  }
  for (const auto& triangle : surface.triangles) {
    for (const uint32_t vertex : triangle) AppendBinary(vertex, &binary_);
  }
}

void GlbFile::Write(const std::filesystem::path& path) {
  CHECK(!nodes_.empty());
  Document document{{}, &binary_};
  Json& json = document.json;
  json["asset"] = {{"version", "2.0"}, {"generator", creator_}};
  json["extensionsUsed"] = {"EXT_mesh_features", "EXT_structural_metadata"};
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", Json::array({0})}}});

  // From the file frame to glTF's, which is y-up: importers that are z-up turn it back.
  Json root = {{"name", "scene"}, {"children", Json::array({1})}};
  const bool turned = transform_.up_axis != "y";
  if (turned) root["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  if (transform_.MetersPerUnit() != 1) {
    root["scale"] = ToJson(Eigen::Vector3d::Constant(transform_.MetersPerUnit()));
  }
  root["extras"] = {{"frame", Json::parse(ExportTransformJson(transform_))}};
  Eigen::AlignedBox3d box;
  for (const Node& node : nodes_) {
    box.extend(node.origin + node.min_position.cast<double>());
    box.extend(node.origin + node.max_position.cast<double>());
  }
  // The middle, rounded to the power of ten that the box fits into; a box of no size is as good as
  // one of any.
  const double edge = box.sizes().maxCoeff();
  const double step = edge > 0 ? std::pow(10, std::ceil(std::log10(edge))) : 1;
  const Eigen::Vector3d middle = step * (box.center() / step).array().round();
  Json origin = {{"name", "origin"}, {"translation", ToJson(middle)}};
  json["nodes"] = {root, origin};

  const Json attributes_of_features = {
      {"featureCount", 1}, {"attribute", 0}, {"propertyTable", 0}, {"label", "object"}};
  for (const Node& node : nodes_) {
    const uint64_t index = json["nodes"].size();
    json["nodes"][1]["children"].push_back(index);
    json["nodes"].push_back({{"name", OneLine(node.object.name)},
                             {"mesh", index - 2},
                             {"translation", ToJson((node.origin - middle).eval())},
                             {"extras",
                              {{"label", node.object.id},
                               {"name", OneLine(node.object.name)},
                               {"confidence", node.object.confidence},
                               {"cells", node.num_cells},
                               {"volume", node.object.volume}}}});

    const uint64_t vertex_bytes = node.num_vertices * kVertexBytes;
    const int vertices = document.AddView(node.first_byte, vertex_bytes);
    json["bufferViews"][vertices]["byteStride"] = kVertexBytes;
    json["bufferViews"][vertices]["target"] = kArrayBuffer;
    const int corners =
        document.AddView(node.first_byte + vertex_bytes, node.num_indices * sizeof(uint32_t));
    json["bufferViews"][corners]["target"] = kElementArrayBuffer;

    const auto attribute = [&](uint64_t at, int type, const char* shape) {
      return document.AddAccessor(vertices, at, type, shape, node.num_vertices);
    };
    const int position = attribute(kPositionAt, kFloat, "VEC3");
    json["accessors"][position]["min"] = ToJson(node.min_position);
    json["accessors"][position]["max"] = ToJson(node.max_position);
    const int normal = attribute(kNormalAt, kFloat, "VEC3");
    const int color = attribute(kColorAt, kUnsignedShort, "VEC4");
    json["accessors"][color]["normalized"] = true;
    const int feature = attribute(kFeatureAt, kFloat, "SCALAR");
    const int confidence = attribute(kConfidenceAt, kFloat, "SCALAR");
    const int indices = document.AddAccessor(corners, 0, kUnsignedInt, "SCALAR", node.num_indices);
    const Json features = {{"featureIds", Json::array({attributes_of_features})}};
    const Json primitive = {{"attributes",
                             {{"POSITION", position},
                              {"NORMAL", normal},
                              {"COLOR_0", color},
                              {"_FEATURE_ID_0", feature},
                              {"_CONFIDENCE", confidence}}},
                            {"indices", indices},
                            {"material", 0},
                            {"extensions", {{"EXT_mesh_features", features}}}};
    json["meshes"].push_back(
        {{"name", node.object.file_stem}, {"primitives", Json::array({primitive})}});
  }
  const Json material = {{"name", "vertex colours"},
                         {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}};
  json["materials"] = Json::array({material});

  std::string names;
  std::string name_offsets;
  std::string colors;
  AppendBinary(uint32_t{0}, &name_offsets);
  for (const Node& node : nodes_) {
    names += OneLine(node.object.name);
    AppendBinary(static_cast<uint32_t>(names.size()), &name_offsets);
    for (const uint8_t channel : node.object.color) AppendBinary(channel, &colors);
  }
  const auto number = [](const char* type, const char* description) {
    return Json{{"type", "SCALAR"}, {"componentType", type}, {"description", description}};
  };
  const Json properties = {
      {"id", number("UINT16", "the label's id")},
      {"name", {{"type", "STRING"}, {"description", "the label's name"}}},
      {"color",
       {{"type", "VEC3"},
        {"componentType", "UINT8"},
        {"description", "the label's colour, display values"}}},
      {"confidence", number("FLOAT64", "mean softmax of the object's class over its cells")},
      {"cells", number("UINT32", "cells of the foam")},
      {"volume", number("FLOAT64", "cubic units of the file frame")}};
  const Json columns = {
      {"id",
       {{"values",
         AddNumbers<uint16_t>(
             nodes_, [](const Node& n) { return n.object.id; }, &document)}}},
      {"name",
       {{"values", document.AddColumn(names)},
        {"stringOffsets", document.AddColumn(name_offsets)}}},
      {"color", {{"values", document.AddColumn(colors)}}},
      {"confidence",
       {{"values",
         AddNumbers<double>(
             nodes_, [](const Node& n) { return n.object.confidence; }, &document)}}},
      {"cells",
       {{"values",
         AddNumbers<uint32_t>(
             nodes_, [](const Node& n) { return n.num_cells; }, &document)}}},
      {"volume",
       {{"values",
         AddNumbers<double>(
             nodes_, [](const Node& n) { return n.object.volume; }, &document)}}}};
  const Json table = {
      {"name", "objects"}, {"class", "object"}, {"count", nodes_.size()}, {"properties", columns}};
  json["extensions"]["EXT_structural_metadata"] = {
      {"schema",
       {{"id", "semantic_foam"},
        {"classes", {{"object", {{"name", "object"}, {"properties", properties}}}}}}},
      {"propertyTables", Json::array({table})}};
  Align('\0', &binary_);
  json["buffers"] = Json::array({{{"byteLength", binary_.size()}}});

  // The binary is to begin aligned too.
  constexpr size_t kHeaders = 12 + 8 + 8;  // of the file and of its two chunks
  std::string text = json.dump();
  while ((kHeaders + text.size()) % kAlignment != 0) text.push_back(' ');
  const uint64_t total = kHeaders + text.size() + binary_.size();
  if (total > std::numeric_limits<uint32_t>::max()) {
    throw UserError(path.string(),
                    ": binary glTF holds at most 4 GiB and this would take ",
                    total,
                    " bytes; leave glb out of --formats.");
  }
  ByteWriter out(path);
  for (const uint32_t word :
       {kMagic, 2u, static_cast<uint32_t>(total), static_cast<uint32_t>(text.size()), kJsonChunk}) {
    out.Binary(word);
  }
  out.Text(text);
  out.Binary(static_cast<uint32_t>(binary_.size()));
  out.Binary(kBinaryChunk);
  out.Text(binary_);
  out.Finish();
}

}  // namespace semfoam
