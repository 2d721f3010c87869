// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/gltf_labels.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"
#include "export/transfer/mesh_parts.h"
#include "export/transfer/value_at.h"
#include "foam/util/base64.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kWhat[] = "a glTF";
constexpr size_t kHeader = 12, kChunkHeader = 8;
constexpr uint32_t kVersion = 2;
// The numbers that glTF gives to modes, types and uses.
constexpr int64_t kTriangles = 4, kStrip = 5, kFan = 6;
constexpr int64_t kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
                  kUnsignedInt = 5125, kFloat = 5126;
constexpr int kElementArrayBuffer = 34963;
constexpr int64_t kMaxCount = int64_t{1} << 52;
// Deeper trees of nodes are taken for damage.
constexpr int kMaxDepth = 1000;

std::string FromUri(std::string_view uri) {
  std::string text;
  for (size_t at = 0; at < uri.size(); ++at) {
    int code = 0;
    const char* digits = uri.data() + at + 1;
    if (uri[at] == '%' && at + 2 < uri.size() &&
        std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      text += static_cast<char>(code);
      at += 2;
    } else {
      text += uri[at];
    }
  }
  return text;
}

std::string ToBase64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t at = 0; at < bytes.size(); at += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (at + k < bytes.size() ? static_cast<uint8_t>(bytes[at + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += at + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
    }
  }
  return text;
}

}  // namespace

bool IsGlb(std::string_view head) { return head.starts_with("glTF"); }

struct GltfMesh::Content {
  // Triangles of a primitive of a node's mesh: those of `mesh` from first_face on.
  struct Primitive {
    size_t index = 0;
    size_t first_face = 0;
    size_t num_faces = 0;
    // Of its positions in `mesh`, and their number.
    uint32_t first_vertex = 0;
    uint64_t num_vertices = 0;
  };
  struct Instance {
    size_t node = 0;
    size_t mesh = 0;
    std::vector<Primitive> primitives;
  };

  explicit Content(const fs::path& from) : path(from) {
    const std::string bytes = ReadFileBytes(path, kWhat);
    if (IsGlb(bytes)) {
      ReadChunks(bytes);
    } else {
      ReadJson(bytes);
    }
    RequirePlain();
    ReadBuffers();
    ReadNodes();
    if (mesh.NumFaces() == 0) {
      throw UserError(path.string(),
                      ": has no triangles; a glTF must be a mesh, clouds are read as PLY.");
    }
  }

  [[noreturn]] void Fail(const std::string& where, const std::string& what) const {
    throw UserError(path.string(), ": ", where, " ", what, "; is it damaged?");
  }

  void ReadJson(std::string_view text) {
    ParseJson(path, WithoutByteOrderMark(text));  // refuses what is none, or too deep
    json = Json::parse(WithoutByteOrderMark(text));
    const Json::const_iterator asset = json.is_object() ? json.find("asset") : json.end();
    if (!json.is_object() || asset == json.end() || !asset->is_object() ||
        asset->value("version", Json()) != "2.0") {
      throw UserError(path.string(), ": is no glTF of version 2.0, which is needed.");
    }
  }

  void ReadChunks(std::string_view bytes) {
    if (bytes.size() < kHeader + kChunkHeader || ValueAt<uint32_t>(bytes, 4) != kVersion) {
      throw UserError(path.string(), ": is no binary glTF of version 2, which is needed.");
    }
    if (const auto size = ValueAt<uint32_t>(bytes, 8); size != bytes.size()) {
      throw UserError(path.string(),
                      ": its header says ",
                      size,
                      " bytes, but it has ",
                      bytes.size(),
                      "; is the copy complete?");
    }
    for (size_t at = kHeader; at < bytes.size();) {
      const size_t left = bytes.size() - at;
      if (left < kChunkHeader || ValueAt<uint32_t>(bytes, at) > left - kChunkHeader) {
        throw UserError(path.string(), ": ends within a chunk; is the copy complete?");
      }
      const std::string_view type = bytes.substr(at + 4, 4);
      const std::string_view data = bytes.substr(at + kChunkHeader, ValueAt<uint32_t>(bytes, at));
      if (at == kHeader) {
        if (type != "JSON") Fail("its first chunk", "is not the JSON");
        ReadJson(data);
      } else if (type == std::string_view("BIN\0", 4) && !binary) {
        binary = std::string(data);
      } else {
        more_chunks.append(bytes.substr(at, kChunkHeader + data.size()));
      }
      at += kChunkHeader + data.size();
    }
    is_glb = true;
  }

  // Refuses what would be left behind, or cannot be read.
  void RequirePlain() const {
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
      for (const Json& name : List(json, list)) {
        if (name == "KHR_draco_mesh_compression" || name == "EXT_meshopt_compression") {
          throw UserError(path.string(),
                          ": is compressed (",
                          name.get<std::string>(),
                          "), which is not read; save it without compression.");
        }
        if (name == "EXT_mesh_gpu_instancing") {
          throw UserError(path.string(),
                          ": has instances (EXT_mesh_gpu_instancing), which are not read; save "
                          "each as a node of its own.");
        }
      }
    }
  }

  // The list of that name, or an empty one.
  const Json& List(const Json& of, const char* name) const {
    static const Json kNone = Json::array();
    const auto list = of.find(name);
    if (list == of.end()) return kNone;
    if (!list->is_array()) Fail(name, "is no list");
    return *list;
  }

  int64_t Integer(const Json& of,
                  const char* key,
                  const std::string& where,
                  int64_t high,
                  std::optional<int64_t> otherwise = {}) const {
    const auto value = of.find(key);
    if (value == of.end() && otherwise) return *otherwise;
    if (value == of.end()) Fail(where, std::string("has no ") + key);
    const bool is_integer =
        value->is_number_unsigned() || (value->is_number_integer() && value->get<int64_t>() >= 0);
    if (!is_integer || high < 0 || value->get<uint64_t>() > static_cast<uint64_t>(high)) {
      Fail(where, std::string("has a ") + key + " that is none");
    }
    return value->get<int64_t>();
  }

  // The element that `of` names by `key`, and its place for messages.
  std::pair<const Json*, std::string> Element(const char* list,
                                              const Json& of,
                                              const char* key,
                                              const std::string& where) const {
    const Json& elements = List(json, list);
    const int64_t index = Integer(of, key, where, kMaxCount);
    return ElementAt(elements, list, index, where + "." + key);
  }
  std::pair<const Json*, std::string> ElementAt(const Json& elements,
                                                const char* list,
                                                int64_t index,
                                                const std::string& where) const {
    if (index >= std::ssize(elements)) {
      Fail(where, "is " + std::to_string(index) + ", which the list " + list + " does not have");
    }
    const Json& element = elements[static_cast<size_t>(index)];
    const std::string place = std::string(list) + "[" + std::to_string(index) + "]";
    if (!element.is_object()) Fail(place, "is no object");
    return {&element, place};
  }

  void ReadBuffers() {
    const Json& list = List(json, "buffers");
    for (int64_t k = 0; k < std::ssize(list); ++k) {
      const auto [buffer, where] = ElementAt(list, "buffers", k, "buffers");
      const auto length = static_cast<size_t>(Integer(*buffer, "byteLength", where, kMaxCount));
      const auto uri = buffer->find("uri");
      if (uri == buffer->end() && k == 0 && binary) {
        buffers.push_back(*binary);
      } else if (uri == buffer->end() || !uri->is_string()) {
        Fail(where, "has no uri");
      } else {
        buffers.push_back(ReadUri(uri->get<std::string>(), where));
      }
      if (buffers.back().size() < length) {
        Fail(
            where,
            "has " + std::to_string(buffers.back().size()) + " bytes of " + std::to_string(length));
      }
      buffers.back().resize(length);
    }
  }

  std::string ReadUri(const std::string& uri, const std::string& where) const {
    if (uri.starts_with("data:")) {
      const size_t comma = uri.find(";base64,");
      const auto bytes = comma == std::string::npos
                             ? std::nullopt
                             : DecodeBase64(std::string_view(uri).substr(comma + 8));
      if (!bytes) Fail(where, "has data that is no base64");
      return *bytes;
    }
    const fs::path relative = fs::path(FromUri(uri)).lexically_normal();
    if (relative.empty() || relative.is_absolute() || *relative.begin() == "..") {
      throw UserError(path.string(),
                      ": ",
                      where,
                      " is not in its folder (",
                      Shortened(uri),
                      "); a relative path below it is needed.");
    }
    return ReadFileBytes(path.parent_path() / relative, "a buffer of " + path.filename().string());
  }

  // What an accessor says, checked against its buffer.
  struct Accessor {
    std::string_view bytes;  // from its first element on
    size_t stride = 0;
    size_t count = 0;
    int64_t type = 0;
    bool is_normalized = false;
  };
  Accessor FindAccessor(const Json& of,
                        const char* key,
                        const std::string& from,
                        const char* shape,
                        size_t components) const {
    const auto [accessor, where] = Element("accessors", of, key, from);
    if (accessor->contains("sparse") || !accessor->contains("bufferView")) {
      throw UserError(path.string(),
                      ": ",
                      where,
                      " is sparse or has no buffer view, which is not read; save it without.");
    }
    if (accessor->value("type", Json()) != shape) Fail(where, std::string("is no ") + shape);
    const auto [view, view_where] = Element("bufferViews", *accessor, "bufferView", where);
    const auto buffer = Integer(*view, "buffer", view_where, std::ssize(buffers) - 1);
    const std::string_view all = buffers[static_cast<size_t>(buffer)];
    const auto begin = static_cast<size_t>(Integer(*view, "byteOffset", view_where, kMaxCount, 0));
    const auto length = static_cast<size_t>(Integer(*view, "byteLength", view_where, kMaxCount));
    if (begin > all.size() || length > all.size() - begin) {
      Fail(view_where, "leaves its buffer of " + std::to_string(all.size()) + " bytes");
    }
    Accessor result;
    result.count = static_cast<size_t>(Integer(*accessor, "count", where, kMaxCount));
    result.type = Integer(*accessor, "componentType", where, kMaxCount);
    result.is_normalized = accessor->value("normalized", Json()) == true;
    const size_t size = result.type == kFloat || result.type == kUnsignedInt     ? 4
                        : result.type == kShort || result.type == kUnsignedShort ? 2
                        : result.type == kByte || result.type == kUnsignedByte   ? 1
                                                                                 : 0;
    if (size == 0) Fail(where, "has a componentType that is none");
    result.stride = static_cast<size_t>(
        Integer(*view, "byteStride", view_where, 1024, static_cast<int64_t>(size * components)));
    const auto offset = static_cast<size_t>(Integer(*accessor, "byteOffset", where, kMaxCount, 0));
    if (offset > length || result.stride < size * components ||
        (result.count > 0 &&
         (length - offset < size * components ||
          result.count - 1 > (length - offset - size * components) / result.stride))) {
      Fail(where, "leaves its buffer view of " + std::to_string(length) + " bytes");
    }
    result.bytes = all.substr(begin + offset, length - offset);
    return result;
  }

  static double Number(const Accessor& accessor, size_t element, size_t component) {
    const auto read = [&]<typename T>(T) -> double {
      const auto value =
          ValueAt<T>(accessor.bytes, element * accessor.stride + component * sizeof(T));
      if (std::is_same_v<T, float> || !accessor.is_normalized) return static_cast<double>(value);
      return std::max(
          -1.0, static_cast<double>(value) / static_cast<double>(std::numeric_limits<T>::max()));
    };
    switch (accessor.type) {
      case kByte:
        return read(int8_t{});
      case kUnsignedByte:
        return read(uint8_t{});
      case kShort:
        return read(int16_t{});
      case kUnsignedShort:
        return read(uint16_t{});
      case kUnsignedInt:
        return read(uint32_t{});
      default:
        return read(float{});
    }
  }

  std::vector<double> Numbers(const Json& of,
                              const char* key,
                              std::vector<double> otherwise,
                              const std::string& where) const {
    const auto list = of.find(key);
    if (list == of.end()) return otherwise;
    std::vector<double> numbers;
    for (const Json& number : List(of, key)) {
      if (number.is_number()) numbers.push_back(number.get<double>());
    }
    if (numbers.size() != otherwise.size() || numbers.size() != list->size()) {
      Fail(where, std::string("has a ") + key + " that is not of numbers");
    }
    return numbers;
  }

  Eigen::Affine3d TransformOf(const Json& node, const std::string& where) const {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    if (node.contains("matrix")) {
      const std::vector<double> m = Numbers(node, "matrix", std::vector<double>(16), where);
      transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
      return transform;
    }
    const std::vector<double> t = Numbers(node, "translation", {0, 0, 0}, where);
    const std::vector<double> r = Numbers(node, "rotation", {0, 0, 0, 1}, where);
    const std::vector<double> s = Numbers(node, "scale", {1, 1, 1}, where);
    return Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(r[3], r[0], r[1], r[2]) *
           Eigen::Scaling(s[0], s[1], s[2]);
  }

  void ReadNodes() {
    const Json& nodes = List(json, "nodes");
    std::vector<uint8_t> has_parent(nodes.size(), 0);
    for (int64_t n = 0; n < std::ssize(nodes); ++n) {
      const auto [node, where] = ElementAt(nodes, "nodes", n, "nodes");
      for (const Json& child : List(*node, "children")) {
        const Json link = {{"child", child}};
        const auto at = static_cast<size_t>(Integer(link, "child", where, std::ssize(nodes) - 1));
        if (has_parent[at]++ != 0) {
          Fail("nodes[" + std::to_string(at) + "]", "has two parents");
        }
      }
    }
    for (size_t n = 0; n < nodes.size(); ++n) {
      if (has_parent[n] != 0) continue;
      const bool is_ours = nodes[n].contains("extras") && nodes[n]["extras"].is_object() &&
                           nodes[n]["extras"].contains("frame");
      const Eigen::Affine3d transform =
          is_ours ? Eigen::Affine3d::Identity()
                  : TransformOf(nodes[n], "nodes[" + std::to_string(n) + "]");
      ReadNode(n, transform, 0);
    }
    if (num_read < nodes.size()) Fail("nodes", "has one that is its own ancestor");
  }

  void ReadNode(size_t n, const Eigen::Affine3d& transform, int depth) {
    const Json& node = json["nodes"][n];
    const std::string where = "nodes[" + std::to_string(n) + "]";
    if (depth > kMaxDepth) Fail(where, "is more than 1000 levels deep");
    ++num_read;
    if (node.contains("mesh")) ReadInstance(n, transform);
    for (const Json& child : List(node, "children")) {
      const auto at = child.get<size_t>();
      ReadNode(at,
               transform * TransformOf(json["nodes"][at], "nodes[" + std::to_string(at) + "]"),
               depth + 1);
    }
  }

  void ReadInstance(size_t n, const Eigen::Affine3d& transform) {
    const Json& node = json["nodes"][n];
    const std::string node_where = "nodes[" + std::to_string(n) + "]";
    const auto [gltf_mesh, where] = Element("meshes", node, "mesh", node_where);
    Instance instance = {n, node["mesh"].get<size_t>(), {}};
    std::map<int64_t, std::pair<uint32_t, uint64_t>> positions;
    const Json& primitives = List(*gltf_mesh, "primitives");
    for (size_t k = 0; k < primitives.size(); ++k) {
      const std::string at = where + ".primitives[" + std::to_string(k) + "]";
      const Json& primitive = primitives[k];
      if (!primitive.is_object()) Fail(at, "is no object");
      const int64_t mode = Integer(primitive, "mode", at, kFan, kTriangles);
      if (mode < kTriangles) continue;
      if (node.contains("skin") || primitive.contains("targets")) {
        throw UserError(path.string(),
                        ": ",
                        node_where,
                        " moves its vertices (a skin, or morph targets), so it has no one shape; "
                        "save it without animation.");
      }
      const auto attributes = primitive.find("attributes");
      if (attributes == primitive.end() || !attributes->is_object()) {
        Fail(at, "has no attributes");
      }
      const Accessor place = FindAccessor(*attributes, "POSITION", at, "VEC3", 3);
      const auto [known, is_new] = positions.try_emplace(
          (*attributes)["POSITION"].get<int64_t>(), mesh.vertices.size(), place.count);
      if (is_new) {
        if (place.count > kNoVertex - 1 - mesh.vertices.size()) {
          throw UserError(path.string(), ": has more than 4294967294 vertices.");
        }
        for (size_t v = 0; v < place.count; ++v) {
          mesh.vertices.push_back(transform * Eigen::Vector3d(Number(place, v, 0),
                                                              Number(place, v, 1),
                                                              Number(place, v, 2)));
        }
      }
      Primitive read = {k, mesh.NumFaces(), 0, known->second.first, place.count};
      ReadTriangles(primitive, at, mode, read);
      read.num_faces = mesh.NumFaces() - read.first_face;
      if (read.num_faces > 0) instance.primitives.push_back(read);
    }
    instances.push_back(std::move(instance));
  }

  void ReadTriangles(const Json& primitive,
                     const std::string& where,
                     int64_t mode,
                     const Primitive& of) {
    Accessor indices;
    const bool has_indices = primitive.contains("indices");
    if (has_indices) {
      indices = FindAccessor(primitive, "indices", where, "SCALAR", 1);
      if (indices.type != kUnsignedByte && indices.type != kUnsignedShort &&
          indices.type != kUnsignedInt) {
        Fail(where, "has indices of another type than unsigned integers");
      }
      indices.is_normalized = false;
    }
    const size_t count = has_indices ? indices.count : of.num_vertices;
    if (mode == kTriangles && count % 3 != 0) {
      Fail(where, "has " + std::to_string(count) + " corners, which are not three a triangle");
    }
    const auto corner = [&](size_t k) {
      const uint64_t index = has_indices ? static_cast<uint64_t>(Number(indices, k, 0)) : k;
      if (index >= of.num_vertices) {
        Fail(where,
             "has the index " + std::to_string(index) + ", but " + std::to_string(of.num_vertices) +
                 " vertices");
      }
      mesh.corners.push_back(of.first_vertex + static_cast<uint32_t>(index));
    };
    const size_t faces = mode == kTriangles ? count / 3 : count < 3 ? 0 : count - 2;
    for (size_t f = 0; f < faces; ++f) {
      // Of a strip, every second triangle is turned over (glTF 2.0, section 3.7.2.1).
      const size_t first = mode == kTriangles ? 3 * f : mode == kStrip ? f : f + 1;
      const size_t turn = mode == kStrip ? f % 2 : 0;
      corner(first);
      corner(mode == kFan ? f + 2 : first + 1 + turn);
      corner(mode == kFan ? 0 : first + 2 - turn);
      mesh.first_corner.push_back(mesh.corners.size());
    }
  }

  const fs::path path;
  bool is_glb = false;
  Json json;
  // Of a .glb: the chunk of its first buffer, and those of others' extensions.
  std::optional<std::string> binary;
  std::string more_chunks;
  std::vector<std::string> buffers;
  PolygonMesh mesh;
  std::vector<Instance> instances;
  size_t num_read = 0;  // nodes
};

namespace {

// Collects indices of new primitives, and the accessors to them.
class IndexBuffer {
 public:
  // `buffer` is the index of the buffer that they are going to be in, from `offset` on.
  IndexBuffer(Json* json, size_t buffer, size_t offset)
      : json_(*json), buffer_(buffer), offset_(offset) {}

  const std::string& bytes() const { return bytes_; }

  // Returns the new accessor.
  size_t Add(const std::vector<uint32_t>& indices, uint64_t num_vertices) {
    // The largest number of a type is no index (it restarts strips).
    const bool is_short = num_vertices <= std::numeric_limits<uint16_t>::max();
    const size_t begin = bytes_.size();
    for (const uint32_t index : indices) {
      if (is_short) {
        AppendBinary(static_cast<uint16_t>(index), &bytes_);
      } else {
        AppendBinary(index, &bytes_);
      }
    }
    json_["bufferViews"].push_back({{"buffer", buffer_},
                                    {"byteOffset", offset_ + begin},
                                    {"byteLength", bytes_.size() - begin},
                                    {"target", kElementArrayBuffer}});
    json_["accessors"].push_back({{"bufferView", json_["bufferViews"].size() - 1},
                                  {"byteOffset", 0},
                                  {"componentType", is_short ? kUnsignedShort : kUnsignedInt},
                                  {"count", indices.size()},
                                  {"type", "SCALAR"}});
    bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
    return json_["accessors"].size() - 1;
  }

 private:
  Json& json_;
  const size_t buffer_, offset_;
  std::string bytes_;
};

void WriteChunk(std::string_view type, std::string bytes, char with, ByteWriter* out) {
  bytes.resize((bytes.size() + 3) / 4 * 4, with);
  out->Binary(static_cast<uint32_t>(bytes.size()));
  out->Text(type);
  out->Text(bytes);
}

}  // namespace

GltfMesh::GltfMesh(const fs::path& path) : content_(std::make_unique<Content>(path)) {}
GltfMesh::~GltfMesh() = default;

const PolygonMesh& GltfMesh::mesh() const { return content_->mesh; }

CompanionFiles GltfMesh::Companions(const fs::path& folder) const {
  CompanionFiles files;
  for (const char* list : {"buffers", "images"}) {
    for (const Json& element : content_->List(content_->json, list)) {
      if (!element.is_object() || !element.contains("uri") || !element["uri"].is_string()) continue;
      const auto uri = element["uri"].get<std::string>();
      if (uri.starts_with("data:")) continue;
      AddCompanionFile(content_->path.parent_path(), folder, FromUri(uri), &files);
    }
  }
  return files;
}

void GltfMesh::Write(const fs::path& output,
                     const std::vector<Label>& labels,
                     const std::vector<SurfaceLabel>& face_labels) const {
  const Content& in = *content_;
  CHECK_EQ(face_labels.size(), in.mesh.NumFaces());
  Json json = in.json;
  const size_t num_buffers = in.List(in.json, "buffers").size();
  // Whether the new indices go behind the first buffer, in the binary chunk.
  const bool in_chunk = in.is_glb && (in.binary || num_buffers == 0);
  std::string chunk = in_chunk && num_buffers > 0 ? in.buffers[0] : std::string();
  chunk.resize((chunk.size() + 3) / 4 * 4, '\0');
  IndexBuffer indices(&json, in_chunk ? 0 : num_buffers, chunk.size());
  // The meshes of the input whose places in the list are taken again.
  std::vector<uint8_t> is_replaced(json["meshes"].size(), 0);
  const auto place_mesh = [&](size_t old, const Json& mesh) {
    if (is_replaced[old] == 0) {
      is_replaced[old] = 1;
      json["meshes"][old] = mesh;
      return old;
    }
    json["meshes"].push_back(mesh);
    return json["meshes"].size() - 1;
  };
  for (const Content::Instance& instance : in.instances) {
    if (instance.primitives.empty()) continue;
    const Json& old = in.json["meshes"][instance.mesh];
    // Label: its primitives; and how many faces and what sum of confidences it has.
    struct Group {
      Json primitives = Json::array();
      size_t faces = 0;
      double confidence = 0;
    };
    std::map<LabelId, Group> groups;
    std::vector<uint8_t> is_triangles(old["primitives"].size(), 0);
    for (const Content::Primitive& primitive : instance.primitives) {
      is_triangles[primitive.index] = 1;
      std::map<LabelId, std::vector<uint32_t>> corners;
      for (size_t f = primitive.first_face; f < primitive.first_face + primitive.num_faces; ++f) {
        Group& group = groups[face_labels[f].id];
        ++group.faces;
        group.confidence += face_labels[f].confidence;
        std::vector<uint32_t>& of = corners[face_labels[f].id];
        for (const uint32_t corner : in.mesh.Face(f)) of.push_back(corner - primitive.first_vertex);
      }
      for (const auto& [id, of_label] : corners) {
        Json copy = old["primitives"][primitive.index];
        if (corners.size() > 1) {
          copy.erase("mode");
          copy["indices"] = indices.Add(of_label, primitive.num_vertices);
        }
        groups[id].primitives.push_back(std::move(copy));
      }
    }
    Json rest = old;
    rest["primitives"] = Json::array();
    for (size_t k = 0; k < is_triangles.size(); ++k) {
      if (is_triangles[k] == 0) rest["primitives"].push_back(old["primitives"][k]);
    }
    if (rest["primitives"].empty()) {
      json["nodes"][instance.node].erase("mesh");
    } else {
      json["nodes"][instance.node]["mesh"] = place_mesh(instance.mesh, rest);
    }
    for (auto& [id, group] : groups) {
      const std::string name = id == kNoObject ? "unlabelled" : DisplayName(id, NameIn(labels, id));
      Json mesh = old;
      mesh["name"] = name;
      mesh["primitives"] = std::move(group.primitives);
      const double confidence = group.confidence / static_cast<double>(group.faces);
      json["nodes"].push_back(
          {{"name", name},
           {"mesh", place_mesh(instance.mesh, mesh)},
           {"extras", {{"label", Value(id)}, {"name", name}, {"confidence", confidence}}}});
      json["nodes"][instance.node]["children"].push_back(json["nodes"].size() - 1);
    }
  }
  if (!indices.bytes().empty() && in_chunk) {
    chunk += indices.bytes();
    if (num_buffers == 0) json["buffers"] = Json::array({Json::object()});
    json["buffers"][0]["byteLength"] = chunk.size();
  } else if (!indices.bytes().empty()) {
    json["buffers"].push_back(
        {{"byteLength", indices.bytes().size()},
         {"uri", "data:application/octet-stream;base64," + ToBase64(indices.bytes())}});
  } else if (in.binary) {
    chunk = *in.binary;
  }
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  ByteWriter out(output);
  if (!in.is_glb) {
    out.Text(text + "\n");
    out.Finish();
    return;
  }
  const bool has_chunk = in.binary || !chunk.empty();
  const auto padded = [](size_t size) { return (size + 3) / 4 * 4; };
  const size_t size = kHeader + kChunkHeader + padded(text.size()) +
                      (has_chunk ? kChunkHeader + padded(chunk.size()) : 0) + in.more_chunks.size();
  if (size > std::numeric_limits<uint32_t>::max()) {
    throw UserError(output.string(),
                    ": would have ",
                    size,
                    " bytes, more than the 4 GiB of a .glb; give the mesh as .gltf.");
  }
  out.Text("glTF");
  out.Binary(kVersion);
  out.Binary(static_cast<uint32_t>(size));
  WriteChunk("JSON", text, ' ', &out);
  if (has_chunk) WriteChunk(std::string_view("BIN\0", 4), chunk, '\0', &out);
  out.Text(in.more_chunks);
  out.Finish();
}

}  // namespace semfoam
