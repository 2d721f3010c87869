// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/om_labels.h"

#include "export/io/byte_writer.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kWhat[] = "an OpenMesh file";
constexpr std::string_view kLabel = "label", kConfidence = "confidence";

enum Entity { kVertex = 0, kMesh = 1, kFace = 2, kEdge = 4, kHalfedge = 6, kSentinel = 7 };
enum Type { kPosition = 0, kColor = 4, kCustom = 6, kTopology = 7 };

// What stands before each part of the file: 16 bits, the lowest first.
struct Chunk {
  explicit Chunk(uint16_t bits)
      : is_named((bits >> 1 & 1) != 0),
        entity(bits >> 2 & 7),
        type(bits >> 5 & 15),
        is_float((bits >> 10 & 1) != 0),
        dimension((bits >> 11 & 7) + 1),
        integer_bytes(1 << (bits >> 14)),
        scalar_bytes(is_float ? 4 << (bits >> 14) : integer_bytes) {}

  bool is_named;
  int entity;
  int type;
  bool is_float;
  int dimension;
  int integer_bytes;  // of the numbers of a topology, whatever is_float says
  int scalar_bytes;   // of everything else
};

class OmReader {
 public:
  OmReader(const fs::path& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  PolygonMesh Read() {
    if (bytes_.rfind("OM", 0) != 0) {
      throw UserError(path_.string(),
                      ": is no OpenMesh file: it does not begin with 'OM'; an .om file of "
                      "mesh_exporter's, or of OpenMesh's, would be right.");
    }
    at_ = 2;
    kind_ = Take<char>();
    version_ = Take<uint8_t>();
    num_vertices_ = Take<uint32_t>();
    num_faces_ = Take<uint32_t>();
    num_edges_ = Take<uint32_t>();
    end_ = at_;
    while (at_ < bytes_.size() && ReadChunk()) end_ = at_;
    FollowEdges();
    if (mesh_.vertices.size() != num_vertices_ || mesh_.NumFaces() != num_faces_) ThrowEnd();
    return std::move(mesh_);
  }

  // Where the labels of an earlier copy are, and where others go.
  const std::vector<std::pair<size_t, size_t>>& ours() const { return ours_; }
  size_t end() const { return end_; }
  // Whether the type of a property's values stands behind its name.
  bool HasTypeNames() const { return IsFrom(2, 2); }

 private:
  // The two halves of the byte that is the version: 3 bits and 5.
  bool IsFrom(int major, int minor) const { return version_ >= (major << 5 | minor); }

  template <typename T>
  T Take() {
    T value;
    if (sizeof(value) > bytes_.size() - at_) ThrowEnd();
    std::memcpy(&value, bytes_.data() + at_, sizeof(value));
    at_ += sizeof(value);
    return value;
  }

  // A signed number; -1 is none.
  int64_t TakeInteger(int size) {
    switch (size) {
      case 1:
        return Take<int8_t>();
      case 2:
        return Take<int16_t>();
      case 4:
        return Take<int32_t>();
      default:
        return Take<int64_t>();
    }
  }

  void Skip(uint64_t count, uint64_t bytes_each) {
    if (bytes_each > 0 && count > (bytes_.size() - at_) / bytes_each) ThrowEnd();
    at_ += count * bytes_each;
  }

  // Returns false at the end.
  bool ReadChunk() {
    const size_t begin = at_;
    const Chunk chunk(Take<uint16_t>());
    if (chunk.entity == kSentinel) return false;
    std::string_view name;
    if (chunk.is_named) {
      const size_t length = Take<uint8_t>();
      Skip(length, 1);
      name = bytes_.substr(at_ - length, length);
      if (HasTypeNames()) Skip(Take<uint8_t>(), 1);
    }
    if (chunk.type == kCustom) {
      Skip(Take<uint32_t>(), 1);
      if ((chunk.entity == kVertex || chunk.entity == kFace) &&
          (name == kLabel || name == kConfidence)) {
        ours_.emplace_back(begin, at_);
      }
    } else if (chunk.type == kTopology) {
      ReadTopology(chunk);
    } else if (chunk.type == kPosition && chunk.entity == kVertex) {
      ReadPositions(chunk);
    } else if (chunk.type <= kColor) {
      Skip(CountOf(chunk), static_cast<uint64_t>(chunk.dimension) * chunk.scalar_bytes);
    } else {
      ThrowUnknown(chunk);
    }
    return true;
  }

  uint64_t CountOf(const Chunk& chunk) const {
    switch (chunk.entity) {
      case kVertex:
        return num_vertices_;
      case kMesh:
        return 1;
      case kFace:
        return num_faces_;
      case kEdge:
        return num_edges_;
      case kHalfedge:
        return 2 * num_edges_;
      default:
        ThrowUnknown(chunk);
    }
  }

  void ReadPositions(const Chunk& chunk) {
    if (!chunk.is_float || chunk.dimension != 3 || chunk.scalar_bytes > 8) ThrowUnknown(chunk);
    while (mesh_.vertices.size() < num_vertices_) {
      Eigen::Vector3d& vertex = mesh_.vertices.emplace_back();
      for (int axis = 0; axis < 3; ++axis) {
        vertex[axis] = chunk.scalar_bytes == 4 ? Take<float>() : Take<double>();
      }
    }
  }

  void ReadTopology(const Chunk& chunk) {
    const int size = chunk.integer_bytes;
    if (chunk.entity == kFace && !IsFrom(2, 0)) {
      while (mesh_.NumFaces() < num_faces_) {
        const int corners = kind_ == 'T' ? 3 : kind_ == 'Q' ? 4 : Take<uint16_t>();
        for (int k = 0; k < corners; ++k) mesh_.corners.push_back(CornerOf(TakeUnsigned(size)));
        mesh_.first_corner.push_back(mesh_.corners.size());
      }
    } else if (chunk.entity == kFace) {
      while (face_halfedge_.size() < num_faces_) face_halfedge_.push_back(TakeInteger(size));
    } else if (chunk.entity == kHalfedge) {
      while (next_.size() < 2 * num_edges_) {
        next_.push_back(TakeInteger(size));
        to_vertex_.push_back(TakeInteger(size));
        TakeInteger(size);  // its face
      }
    } else if (chunk.entity == kVertex) {
      Skip(num_vertices_, size);  // a halfedge of each
    } else {
      ThrowUnknown(chunk);
    }
  }

  int64_t TakeUnsigned(int size) {
    const int64_t value = TakeInteger(size);
    return size < 8 ? value & ((int64_t{1} << 8 * size) - 1) : value;
  }

  static uint32_t CornerOf(int64_t vertex) {
    return vertex < 0 || vertex >= kNoVertex ? kNoVertex : static_cast<uint32_t>(vertex);
  }

  // The corners of faces that are told by one of their halfedges, since version 2. A halfedge
  // belongs to one face, so all of them together have no more corners than there are halfedges.
  void FollowEdges() {
    const auto num_halfedges = static_cast<int64_t>(next_.size());
    int64_t left = num_halfedges;
    for (const int64_t first : face_halfedge_) {
      int64_t at = first;
      do {
        if (at < 0 || at >= num_halfedges || left-- == 0) {
          throw UserError(path_.string(),
                          ": has a face whose edges do not close; is the file damaged?");
        }
        mesh_.corners.push_back(CornerOf(to_vertex_[at]));
        at = next_[at];
      } while (at != first);
      mesh_.first_corner.push_back(mesh_.corners.size());
    }
  }

  [[noreturn]] void ThrowEnd() const {
    throw UserError(path_.string(),
                    ": ends too early: its header says ",
                    num_vertices_,
                    " vertices, ",
                    num_faces_,
                    " faces and ",
                    num_edges_,
                    " edges; is the copy complete?");
  }

  [[noreturn]] void ThrowUnknown(const Chunk& chunk) const {
    throw UserError(path_.string(),
                    ": has a part that is not understood (entity ",
                    chunk.entity,
                    ", type ",
                    chunk.type,
                    "); is the file damaged?");
  }

  const fs::path path_;
  const std::string_view bytes_;
  size_t at_ = 0;
  char kind_ = 0;  // triangles, quads or polygons
  int version_ = 0;
  uint64_t num_vertices_ = 0, num_faces_ = 0, num_edges_ = 0;
  PolygonMesh mesh_;
  std::vector<int64_t> face_halfedge_;
  std::vector<int64_t> next_, to_vertex_;  // of the halfedges
  std::vector<std::pair<size_t, size_t>> ours_;
  size_t end_ = 0;
};

// Appends a property of vertices or faces, in the form that OpenMesh gives it.
template <typename Entry>
void AppendProperty(Entity entity,
                    std::string_view name,
                    std::string_view type_name,
                    bool has_type_name,
                    const std::vector<SurfaceLabel>& labels,
                    const Entry& entry,
                    std::string* bytes) {
  AppendBinary(static_cast<uint16_t>(1 << 1 | entity << 2 | kCustom << 5), bytes);
  AppendBinary(static_cast<uint8_t>(name.size()), bytes);
  bytes->append(name);
  if (has_type_name) {
    AppendBinary(static_cast<uint8_t>(type_name.size()), bytes);
    bytes->append(type_name);
  }
  AppendBinary(static_cast<uint32_t>(4 * labels.size()), bytes);
  for (const SurfaceLabel& label : labels) AppendBinary(entry(label), bytes);
}

}  // namespace

bool IsOm(std::string_view head) {
  return head.size() >= 4 && head.starts_with("OM") &&
         std::string_view("TQP").find(head[2]) != std::string_view::npos &&
         static_cast<uint8_t>(head[3]) >> 5 <= 2;
}

PolygonMesh ReadOmPolygonMesh(const fs::path& path) {
  const std::string bytes = ReadFileBytes(path, kWhat);
  return OmReader(path, bytes).Read();
}

void CopyOmWithLabels(const fs::path& input,
                      const fs::path& output,
                      const std::vector<SurfaceLabel>& vertex_labels,
                      const std::vector<SurfaceLabel>& face_labels) {
  const std::string bytes = ReadFileBytes(input, kWhat);
  OmReader reader(input, bytes);
  const PolygonMesh mesh = reader.Read();
  CHECK_EQ(mesh.vertices.size(), vertex_labels.size());
  CHECK_EQ(mesh.NumFaces(), face_labels.size());
  std::string properties;
  for (const Entity entity : {kVertex, kFace}) {
    const auto& labels = entity == kVertex ? vertex_labels : face_labels;
    const auto append = [&](std::string_view name, std::string_view type, const auto& entry) {
      AppendProperty(entity, name, type, reader.HasTypeNames(), labels, entry, &properties);
    };
    append(kLabel, "int32_t", [](const SurfaceLabel& label) { return Value(label.id); });
    append(kConfidence, "float", [](const SurfaceLabel& label) { return label.confidence; });
  }
  ByteWriter out(output);
  size_t at = 0;
  for (const auto& [begin, end] : reader.ours()) {
    out.Text(std::string_view(bytes).substr(at, begin - at));
    at = end;
  }
  out.Text(std::string_view(bytes).substr(at, reader.end() - at));
  out.Text(properties);
  out.Text(std::string_view(bytes).substr(reader.end()));
  out.Finish();
}

}  // namespace semfoam
