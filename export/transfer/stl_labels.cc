// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/stl_labels.h"

#include "export/io/byte_writer.h"
#include "export/transfer/mesh_parts.h"
#include "export/transfer/ply_labels.h"
#include "export/transfer/value_at.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <unordered_map>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kWhat[] = "an STL";
constexpr std::string_view kBlanks = " \t\r\n\v\f";
// Of a binary STL: what stands before the count, and the size of a facet (normal, three corners,
// two bytes that nobody defines).
constexpr size_t kHeader = 80, kFirstFacet = 84, kFacet = 50, kAttribute = 48;

bool IsBinary(std::string_view head, uint64_t size) {
  return size >= kFirstFacet && head.size() >= kFirstFacet &&
         size == kFirstFacet + uint64_t{kFacet} * ValueAt<uint32_t>(head, kHeader);
}

// The vertices of a mesh by their places.
class VertexIndex {
 public:
  explicit VertexIndex(PolygonMesh* mesh) : mesh_(*mesh) {}

  void AddCorner(const Eigen::Vector3d& x) {
    // -0 + 0 is 0.
    const Key key = {std::bit_cast<uint64_t>(x.x() + 0.0),
                     std::bit_cast<uint64_t>(x.y() + 0.0),
                     std::bit_cast<uint64_t>(x.z() + 0.0)};
    const auto [at, is_new] = index_.emplace(key, static_cast<uint32_t>(mesh_.vertices.size()));
    if (is_new) mesh_.vertices.push_back(x);
    mesh_.corners.push_back(at->second);
  }
  void EndFace() { mesh_.first_corner.push_back(mesh_.corners.size()); }

 private:
  using Key = std::array<uint64_t, 3>;
  struct Hash {
    size_t operator()(const Key& key) const {
      uint64_t hash = 0;
      for (const uint64_t part : key) hash = (std::rotl(hash, 23) ^ part) * 0x9E3779B97F4A7C15u;
      return hash ^ hash >> 32;
    }
  };

  PolygonMesh& mesh_;
  std::unordered_map<Key, uint32_t, Hash> index_;
};

void ReadBinary(const fs::path& path, StlMesh* stl) {
  const std::string_view bytes = stl->bytes;
  if (!IsBinary(bytes, bytes.size())) {
    if (bytes.size() < kFirstFacet) {
      throw UserError(path.string(),
                      ": has ",
                      bytes.size(),
                      " bytes; an STL begins with `solid`, or with 84 bytes before its triangles.");
    }
    throw UserError(path.string(),
                    ": its header says ",
                    ValueAt<uint32_t>(bytes, kHeader),
                    " triangles, but its size, ",
                    bytes.size(),
                    " bytes, is that of ",
                    (bytes.size() - kFirstFacet) / kFacet,
                    "; is the copy complete, and is it an STL?");
  }
  VertexIndex vertices(&stl->mesh);
  for (size_t at = kFirstFacet; at < bytes.size(); at += kFacet) {
    for (size_t corner = 1; corner <= 3; ++corner) {
      Eigen::Vector3d x;
      for (int axis = 0; axis < 3; ++axis) {
        x[axis] = ValueAt<float>(bytes, at + 12 * corner + 4 * axis);
      }
      vertices.AddCorner(x);
    }
    vertices.EndFace();
    stl->facets.emplace_back(at, at + kFacet);
  }
}

// Reads the words of a text.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  size_t at() const { return at_; }

  // Empty at the end.
  std::string_view Next() {
    const size_t begin = std::min(text_.find_first_not_of(kBlanks, at_), text_.size());
    at_ = std::min(text_.find_first_of(kBlanks, begin), text_.size());
    return text_.substr(begin, at_ - begin);
  }
  void EndLine() { at_ = std::min(text_.find('\n', at_), text_.size() - 1) + 1; }

  bool NextIs(std::string_view keyword) {
    const std::string_view word = Next();
    return std::equal(
        word.begin(), word.end(), keyword.begin(), keyword.end(), [](unsigned char a, char b) {
          return std::tolower(a) == b;
        });
  }
  bool NextNumber(double* number) {
    std::string_view word = Next();
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), *number);
    return code == std::errc() && end == word.data() + word.size() && !word.empty();
  }
  bool NextPlace(Eigen::Vector3d* x) {
    return NextNumber(&x->x()) && NextNumber(&x->y()) && NextNumber(&x->z());
  }

 private:
  const std::string_view text_;
  size_t at_ = 0;
};

// Reads a facet behind its first word.
bool ReadTextFacet(Words* words, VertexIndex* vertices) {
  Eigen::Vector3d x;
  if (!words->NextIs("normal") || !words->NextPlace(&x) || !words->NextIs("outer") ||
      !words->NextIs("loop")) {
    return false;
  }
  for (int corner = 0; corner < 3; ++corner) {
    if (!words->NextIs("vertex") || !words->NextPlace(&x)) return false;
    vertices->AddCorner(x);
  }
  return words->NextIs("endloop") && words->NextIs("endfacet");
}

void ReadText(const fs::path& path, StlMesh* stl) {
  const std::string_view text = stl->bytes;
  Words words(text);
  VertexIndex vertices(&stl->mesh);
  bool in_solid = false;
  while (true) {
    const std::string_view word = words.Next();
    const size_t begin = words.at() - word.size();
    const auto is = [&](std::string_view keyword) { return Words(word).NextIs(keyword); };
    if (word.empty()) break;
    if (is("solid") || is("endsolid")) {
      in_solid = is("solid");
      words.EndLine();  // its name
    } else if (in_solid && is("facet") && ReadTextFacet(&words, &vertices)) {
      vertices.EndFace();
      const size_t rest = std::min(text.find_first_not_of(" \t\r", words.at()), text.size());
      stl->facets.emplace_back(begin, text.substr(rest).starts_with('\n') ? rest + 1 : words.at());
    } else {
      throw UserError(
          path.string(),
          ": line ",
          1 + std::count(text.begin(), text.begin() + static_cast<int64_t>(begin), '\n'),
          " is no facet with a normal and three corners of three numbers; is it "
          "damaged, or no STL?");
    }
  }
  if (in_solid) {
    throw UserError(path.string(),
                    ": ends without `endsolid`, behind ",
                    stl->facets.size(),
                    " facets; is the copy complete?");
  }
}

bool IsText(std::string_view bytes) {
  return Words(WithoutByteOrderMark(bytes)).NextIs("solid") &&
         bytes.substr(0, kFirstFacet).find('\0') == std::string_view::npos;
}

// The numbers of the normal of a facet.
Eigen::Vector3d NormalOf(const StlMesh& stl, size_t f) {
  Eigen::Vector3d normal;
  if (stl.is_text) {
    Words words(stl.Facet(f));
    CHECK(words.NextIs("facet") && words.NextIs("normal") && words.NextPlace(&normal));
    return normal;
  }
  for (int axis = 0; axis < 3; ++axis) normal[axis] = ValueAt<float>(stl.Facet(f), 4 * axis);
  return normal;
}

// Appends a facet that is new.
void WriteFacet(const std::array<Eigen::Vector3d, 3>& corners, bool is_text, ByteWriter* out) {
  const Eigen::Vector3d normal =
      (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  if (!is_text) {
    for (const double x : normal) out->Binary(static_cast<float>(x));
    for (const Eigen::Vector3d& corner : corners) {
      for (const double x : corner) out->Binary(static_cast<float>(x));
    }
    out->Binary(uint16_t{0});
    return;
  }
  const auto place = [&](const char* keyword, const Eigen::Vector3d& x) {
    out->Text(keyword);
    for (const double coordinate : x) {
      out->Text(" ");
      out->Number(coordinate);
    }
    out->Text("\n");
  };
  place("facet normal", normal);
  out->Text("outer loop\n");
  for (const Eigen::Vector3d& corner : corners) place("vertex", corner);
  out->Text("endloop\nendfacet\n");
}

}  // namespace

bool IsStl(std::string_view head, uint64_t size) { return IsBinary(head, size) || IsText(head); }

StlMesh ReadStl(const fs::path& path) {
  StlMesh stl;
  stl.bytes = ReadFileBytes(path, kWhat);
  // Some binary files begin with `solid`, too.
  stl.is_text = !IsBinary(stl.bytes, stl.bytes.size()) && IsText(stl.bytes);
  if (stl.is_text) {
    stl.bytes.erase(0, stl.bytes.size() - WithoutByteOrderMark(stl.bytes).size());
    ReadText(path, &stl);
  } else {
    ReadBinary(path, &stl);
  }
  if (stl.facets.empty()) {
    throw UserError(path.string(), ": has no triangles; a mesh is needed.");
  }
  return stl;
}

void WriteStlAsLabelledPly(const StlMesh& stl,
                           const fs::path& output,
                           const std::vector<Label>& labels,
                           std::span<const SurfaceLabel> vertex_labels,
                           std::span<const SurfaceLabel> face_labels) {
  CHECK_EQ(vertex_labels.size(), stl.mesh.vertices.size());
  CHECK_EQ(face_labels.size(), stl.mesh.NumFaces());
  const auto attribute = [&](size_t f) {
    return stl.is_text ? uint16_t{0} : ValueAt<uint16_t>(stl.Facet(f), kAttribute);
  };
  bool has_attributes = false;
  for (size_t f = 0; f < stl.facets.size(); ++f) has_attributes |= attribute(f) != 0;
  const std::string type = stl.is_text ? "double" : "float";
  const std::string ours = "property int label\nproperty float confidence\n";
  const auto properties = [&](std::initializer_list<const char*> names) {
    std::string lines;
    for (const char* name : names) lines.append("property " + type + " " + name + "\n");
    return lines;
  };
  ByteWriter out(output);
  out.Text("ply\nformat binary_little_endian 1.0\n" + PlyLabelComments(labels) + "element vertex " +
           std::to_string(vertex_labels.size()) + "\n" + properties({"x", "y", "z"}) + ours +
           "element face " + std::to_string(face_labels.size()) +
           "\nproperty list uchar int vertex_indices\n" + properties({"nx", "ny", "nz"}) +
           (has_attributes ? "property ushort attribute\n" : "") + ours + "end_header\n");
  const auto write_place = [&](const Eigen::Vector3d& x) {
    for (const double coordinate : x) {
      if (stl.is_text) {
        out.Binary(coordinate);
      } else {
        out.Binary(static_cast<float>(coordinate));
      }
    }
  };
  const auto write_label = [&](const SurfaceLabel& label) {
    out.Binary(Value(label.id));
    out.Binary(label.confidence);
  };
  for (size_t v = 0; v < vertex_labels.size(); ++v) {
    write_place(stl.mesh.vertices[v]);
    write_label(vertex_labels[v]);
  }
  for (size_t f = 0; f < face_labels.size(); ++f) {
    out.Binary(uint8_t{3});
    for (const uint32_t corner : stl.mesh.Face(f)) out.Binary(static_cast<int32_t>(corner));
    write_place(NormalOf(stl, f));
    if (has_attributes) out.Binary(attribute(f));
    write_label(face_labels[f]);
  }
  out.Finish();
}

std::vector<WrittenFile> SplitLabelledStl(const StlMesh& stl,
                                          const fs::path& folder,
                                          const std::vector<Label>& labels,
                                          const std::vector<SurfaceLabel>& face_labels,
                                          bool cap) {
  const MeshParts split = FindMeshParts(face_labels);
  const std::vector<MeshPart> parts = TakeApart(stl.mesh, split, cap);
  std::vector<WrittenFile> files = PartFiles(split, labels, "stl");
  for (size_t k = 0; k < parts.size(); ++k) {
    const MeshPart& part = parts[k];
    const std::string name = fs::path(files[k].path).stem().string();
    ByteWriter out(folder / files[k].path);
    if (stl.is_text) {
      out.Text("solid " + name + "\n");
    } else {
      out.Text(std::string_view(stl.bytes).substr(0, kHeader));
      out.Binary(static_cast<uint32_t>(part.NumFaces()));
    }
    for (const uint32_t f : part.faces) {
      out.Text(stl.Facet(f));
      if (stl.is_text && !stl.Facet(f).ends_with('\n')) out.Text("\n");
    }
    for (const auto& [a, b, c] : part.cap_triangles) {
      WriteFacet({part.Place(stl.mesh, a), part.Place(stl.mesh, b), part.Place(stl.mesh, c)},
                 stl.is_text,
                 &out);
    }
    if (stl.is_text) out.Text("endsolid " + name + "\n");
    out.Finish();
    files[k].summary = PartSummary(part.NumVertices(), part.NumFaces(), part.num_caps);
  }
  return files;
}

}  // namespace semfoam
