// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/glb_file.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"
#include "foam/util/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

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
constexpr uint64_t kCoordinatesAt = 40;
constexpr uint64_t kVertexBytes = 40;
constexpr uint64_t kTexturedVertexBytes = 48;

constexpr int kLinear = 9729;
constexpr int kLinearMipmapLinear = 9987;
constexpr int kClampToEdge = 33071;

constexpr uint64_t Aligned(uint64_t offset) {
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

void Align(char with, std::string* bytes) { bytes->resize(Aligned(bytes->size()), with); }

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

  // Appends the bytes, aligned, as a buffer view. Returns its index.
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

// Adds a column with one number per row of a property table.
template <typename T, typename Rows, typename Value>
int AddNumbers(const Rows& rows, const Value& value, Document* document) {
  std::string bytes;
  for (const auto& row : rows) AppendBinary(static_cast<T>(value(row)), &bytes);
  return document->AddColumn(bytes);
}

// The root's node, from the file frame to glTF's, which is y-up: importers that are z-up turn it
// back.
Json RootNode(const ExportTransform& transform) {
  Json root = {{"name", "scene"}, {"children", Json::array({1})}};
  if (transform.up_axis != UpAxis::kY) root["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  if (transform.MetersPerUnit() != 1) {
    root["scale"] = ToJson(Eigen::Vector3d::Constant(transform.MetersPerUnit()));
  }
  root["extras"] = {{"frame", Json::parse(ExportTransformJson(transform))}};
  return root;
}

// The middle of the objects' box, file frame, rounded to the power of ten that the box fits into; a
// box of no size is as good as one of any.
Eigen::Vector3d RoundedMiddle(std::span<const GlbObject> objects) {
  Eigen::AlignedBox3d all;
  for (const GlbObject& object : objects) {
    all.extend(object.origin + object.box.min().cast<double>());
    all.extend(object.origin + object.box.max().cast<double>());
  }
  const double edge = all.sizes().maxCoeff();
  const double step = edge > 0 ? std::pow(10, std::ceil(std::log10(edge))) : 1;
  return step * (all.center() / step).array().round();
}

// Returns the node of an object below the one that moves to `middle`.
Json ObjectNode(const GlbObject& object, uint64_t mesh, const Eigen::Vector3d& middle) {
  const std::string name = OneLine(object.info.name);
  return {{"name", name},
          {"mesh", mesh},
          {"translation", ToJson((object.origin - middle).eval())},
          {"extras",
           {{"label", Value(object.info.id)},
            {"name", name},
            {"confidence", object.info.confidence},
            {"cells", object.num_cells},
            {"volume", object.info.volume}}}};
}

// Adds a material that is matt. Returns its index.
size_t AddMaterial(const std::string& name, Json color, Document* document) {
  Json material = {{"name", name},
                   {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}};
  if (!color.is_null()) material["pbrMetallicRoughness"]["baseColorTexture"] = std::move(color);
  document->json["materials"].push_back(std::move(material));
  return document->json["materials"].size() - 1;
}

// Adds the texture of an object, whose bytes are at `from`, and its material. Returns that of the
// material.
size_t AddTexturedMaterial(const GlbObject& object, uint64_t from, Document* document) {
  Json& json = document->json;
  const int view = document->AddView(from, object.texture_bytes);
  json["images"].push_back(
      {{"name", object.info.file_stem}, {"bufferView", view}, {"mimeType", object.texture_type}});
  json["samplers"] = Json::array({{{"magFilter", kLinear},
                                   {"minFilter", kLinearMipmapLinear},
                                   {"wrapS", kClampToEdge},
                                   {"wrapT", kClampToEdge}}});
  json["textures"].push_back({{"sampler", 0}, {"source", json["images"].size() - 1}});
  return AddMaterial(object.info.file_stem, {{"index", json["textures"].size() - 1}}, document);
}

// Adds the views and accessors of an object's vertices and indices. Returns its mesh primitive.
Json AddPrimitive(const GlbObject& object, Document* document) {
  Json& json = document->json;
  const bool is_textured = object.texture_bytes > 0;
  const uint64_t stride = is_textured ? kTexturedVertexBytes : kVertexBytes;
  const uint64_t vertex_bytes = object.num_vertices * stride;
  const int vertices = document->AddView(object.first_byte, vertex_bytes);
  json["bufferViews"][vertices]["byteStride"] = stride;
  json["bufferViews"][vertices]["target"] = kArrayBuffer;
  const int corners =
      document->AddView(object.first_byte + vertex_bytes, object.num_indices * sizeof(uint32_t));
  json["bufferViews"][corners]["target"] = kElementArrayBuffer;

  const auto attribute = [&](uint64_t at, int type, const char* shape) {
    return document->AddAccessor(vertices, at, type, shape, object.num_vertices);
  };
  const int position = attribute(kPositionAt, kFloat, "VEC3");
  json["accessors"][position]["min"] = ToJson(object.box.min());
  json["accessors"][position]["max"] = ToJson(object.box.max());
  const int normal = attribute(kNormalAt, kFloat, "VEC3");
  const int color = attribute(kColorAt, kUnsignedShort, "VEC4");
  json["accessors"][color]["normalized"] = true;
  const int feature = attribute(kFeatureAt, kFloat, "SCALAR");
  const int confidence = attribute(kConfidenceAt, kFloat, "SCALAR");
  const int indices = document->AddAccessor(corners, 0, kUnsignedInt, "SCALAR", object.num_indices);
  Json attributes = {{"POSITION", position},
                     {"NORMAL", normal},
                     {is_textured ? "_COLOR" : "COLOR_0", color},
                     {"_FEATURE_ID_0", feature},
                     {"_CONFIDENCE", confidence}};
  size_t material = 0;
  if (is_textured) {
    attributes["TEXCOORD_0"] = attribute(kCoordinatesAt, kFloat, "VEC2");
    const uint64_t indices_end =
        object.first_byte + vertex_bytes + object.num_indices * sizeof(uint32_t);
    material = AddTexturedMaterial(object, Aligned(indices_end), document);
  }
  const Json feature_id = {
      {"featureCount", 1}, {"attribute", 0}, {"propertyTable", 0}, {"label", "object"}};
  const Json features = {{"featureIds", Json::array({feature_id})}};
  return {{"attributes", std::move(attributes)},
          {"indices", indices},
          {"material", material},
          {"extensions", {{"EXT_mesh_features", features}}}};
}

// Returns the properties of the table of objects, by EXT_structural_metadata.
Json TableSchema() {
  const auto number = [](const char* type, const char* description) {
    return Json{{"type", "SCALAR"}, {"componentType", type}, {"description", description}};
  };
  return {{"id", number("UINT16", "the label's id")},
          {"name", {{"type", "STRING"}, {"description", "the label's name"}}},
          {"color",
           {{"type", "VEC3"},
            {"componentType", "UINT8"},
            {"description", "the label's colour, display values"}}},
          {"confidence", number("FLOAT64", "mean softmax of the object's class over its cells")},
          {"cells", number("UINT32", "cells of the foam")},
          {"volume", number("FLOAT64", "cubic units of the file frame")}};
}

// Adds the columns of the table of objects to the binary. Returns where each is, in the order of
// TableSchema.
Json AddTableColumns(std::span<const GlbObject> objects, Document* document) {
  std::string names;
  std::string name_offsets;
  std::string colors;
  AppendBinary(uint32_t{0}, &name_offsets);
  for (const GlbObject& object : objects) {
    names += OneLine(object.info.name);
    AppendBinary(static_cast<uint32_t>(names.size()), &name_offsets);
    for (const uint8_t channel : object.info.color) AppendBinary(channel, &colors);
  }
  // One column after the other, as they are to lie in the binary.
  Json columns;
  columns["id"]["values"] = AddNumbers<uint16_t>(
      objects, [](const GlbObject& o) { return Value(o.info.id); }, document);
  columns["name"]["values"] = document->AddColumn(names);
  columns["name"]["stringOffsets"] = document->AddColumn(name_offsets);
  columns["color"]["values"] = document->AddColumn(colors);
  columns["confidence"]["values"] = AddNumbers<double>(
      objects, [](const GlbObject& o) { return o.info.confidence; }, document);
  columns["cells"]["values"] = AddNumbers<uint32_t>(
      objects, [](const GlbObject& o) { return o.num_cells; }, document);
  columns["volume"]["values"] = AddNumbers<double>(
      objects, [](const GlbObject& o) { return o.info.volume; }, document);
  return columns;
}

// Writes the file: its header, the JSON chunk and the binary chunk. Throws UserError where that is
// more than glTF's 4 GiB.
void WriteChunks(const Json& json, const std::string& binary, const std::filesystem::path& path) {
  // The binary is to begin aligned too.
  constexpr size_t kHeaders = 12 + 8 + 8;  // of the file and of its two chunks
  std::string text = json.dump();
  while ((kHeaders + text.size()) % kAlignment != 0) text.push_back(' ');
  const uint64_t total = kHeaders + text.size() + binary.size();
  if (total > std::numeric_limits<uint32_t>::max()) {
    throw UserError(path.string(),
                    ": binary glTF holds at most 4 GiB and this would take ",
                    total,
                    " bytes; leave glb out of ",
                    Field{"formats"},
                    ".");
  }
  ByteWriter out(path);
  for (const uint32_t word :
       {kMagic, 2u, static_cast<uint32_t>(total), static_cast<uint32_t>(text.size()), kJsonChunk}) {
    out.Binary(word);
  }
  out.Text(text);
  out.Binary(static_cast<uint32_t>(binary.size()));
  out.Binary(kBinaryChunk);
  out.Text(binary);
  out.Finish();
}

}  // namespace

GlbFile::GlbFile(const ExportTransform& transform, std::string creator)
    : transform_(transform), creator_(std::move(creator)) {}

void GlbFile::Add(const ObjectInfo& object,
                  const ObjectSurface& surface,
                  const LocalMesh& mesh,
                  const SurfaceTexture* texture) {
  GlbObject& kept = objects_.emplace_back();
  kept.info = object;
  kept.num_cells = object.cells.size();
  kept.info.cells.clear();
  kept.origin = mesh.origin;
  kept.box = mesh.box;
  kept.num_vertices = texture == nullptr ? surface.vertices.size() : texture->coordinates.size();
  kept.num_indices = 3 * surface.triangles.size();
  Align('\0', &binary_);
  kept.first_byte = binary_.size();
  // 2^24 rows are more than labels have ids.
  const float row = static_cast<float>(objects_.size() - 1);
  for (size_t i = 0; i < kept.num_vertices; ++i) {
    const size_t v = texture == nullptr ? i : texture->vertex_of[i];
    for (const float x : mesh.positions[v]) AppendBinary(x, &binary_);
    for (const float x : mesh.normals[v]) AppendBinary(x, &binary_);
    for (const uint8_t channel : surface.vertex_color[v]) {
      const float light = LinearLight(channel);
      AppendBinary(static_cast<uint16_t>(std::lround(65535 * light)), &binary_);
    }
    AppendBinary(uint16_t{65535}, &binary_);  // opaque
    AppendBinary(row, &binary_);
    AppendBinary(surface.vertex_confidence[v], &binary_);
    if (texture == nullptr) continue;
    for (const float x : texture->coordinates[i]) AppendBinary(x, &binary_);
  }
  for (const auto& triangle : texture == nullptr ? surface.triangles : texture->triangles) {
    for (const uint32_t vertex : triangle) AppendBinary(vertex, &binary_);
  }
  if (texture == nullptr) return;
  Align('\0', &binary_);
  kept.texture_bytes = texture->file.size();
  kept.texture_type = texture->extension == "png" ? "image/png" : "image/jpeg";
  binary_ += texture->file;
}

void GlbFile::Write(const std::filesystem::path& path) {
  CHECK(!objects_.empty());
  Document document{{}, &binary_};
  Json& json = document.json;
  json["asset"] = {{"version", "2.0"}, {"generator", creator_}};
  json["extensionsUsed"] = {"EXT_mesh_features", "EXT_structural_metadata"};
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  const bool has_plain = std::any_of(objects_.begin(), objects_.end(), [](const GlbObject& object) {
    return object.texture_bytes == 0;
  });
  if (has_plain) AddMaterial("vertex colours", {}, &document);
  const Eigen::Vector3d middle = RoundedMiddle(objects_);
  json["nodes"] = {RootNode(transform_), {{"name", "origin"}, {"translation", ToJson(middle)}}};
  for (const GlbObject& object : objects_) {
    const uint64_t index = json["nodes"].size();
    json["nodes"][1]["children"].push_back(index);
    json["nodes"].push_back(ObjectNode(object, /*mesh=*/index - 2, middle));
    const Json primitive = AddPrimitive(object, &document);
    json["meshes"].push_back(
        {{"name", object.info.file_stem}, {"primitives", Json::array({primitive})}});
  }
  const Json table = {{"name", "objects"},
                      {"class", "object"},
                      {"count", objects_.size()},
                      {"properties", AddTableColumns(objects_, &document)}};
  json["extensions"]["EXT_structural_metadata"] = {
      {"schema",
       {{"id", "semantic_foam"},
        {"classes", {{"object", {{"name", "object"}, {"properties", TableSchema()}}}}}}},
      {"propertyTables", Json::array({table})}};
  Align('\0', &binary_);
  json["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
  WriteChunks(json, binary_, path);
}

}  // namespace semfoam
