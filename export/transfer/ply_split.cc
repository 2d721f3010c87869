// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/ply_split.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"
#include "export/transfer/polygon_mesh.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Returns the labels of all records of the elements that `is_wanted` has.
template <typename IsWanted>
std::vector<LabelId> ReadLabels(const fs::path& path, const IsWanted& is_wanted) {
  PlyReader reader(path, "a labelled PLY");
  std::vector<LabelId> labels;
  for (const PlyElement& element : reader.header().elements) {
    const bool is_read = is_wanted(element) && element.count > 0;
    const size_t label = is_read ? reader.RequireProperty(element, {"label"}) : 0;
    reader.ReadRecords(element, [&](uint64_t, size_t column, double value) {
      if (is_read && column == label) labels.push_back(LabelId{static_cast<int32_t>(value)});
    });
  }
  return labels;
}

// One file.
struct Part {
  uint32_t vertices = 0;
  uint64_t faces = 0;
  std::unique_ptr<ByteWriter> out;
};

// A vertex in a part, and its index there.
struct Use {
  uint32_t vertex = 0;
  uint32_t part = 0;
  uint32_t index = 0;
};

// Returns the vertices of each part, by ascending vertex; counts them in `parts`.
std::vector<Use> UsesOf(const PolygonMesh& mesh,
                        const std::vector<uint32_t>& part_of_vertex,
                        const std::vector<uint32_t>& part_of_face,
                        std::vector<Part>* parts) {
  const uint32_t none = static_cast<uint32_t>(parts->size());
  std::vector<Use> uses;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    if (part_of_face[f] == none) continue;
    ++(*parts)[part_of_face[f]].faces;
    for (const uint32_t corner : mesh.Face(f)) uses.push_back({corner, part_of_face[f], 0});
  }
  if (mesh.NumFaces() == 0) {
    for (uint32_t v = 0; v < part_of_vertex.size(); ++v) {
      if (part_of_vertex[v] != none) uses.push_back({v, part_of_vertex[v], 0});
    }
  }
  const auto key = [](const Use& use) { return std::pair(use.vertex, use.part); };
  std::sort(uses.begin(), uses.end(), [&](const Use& a, const Use& b) { return key(a) < key(b); });
  uses.erase(
      std::unique(
          uses.begin(), uses.end(), [&](const Use& a, const Use& b) { return key(a) == key(b); }),
      uses.end());
  for (Use& use : uses) use.index = (*parts)[use.part].vertices++;
  return uses;
}

// Returns the header of a part: the counts are its own, other elements are gone.
std::string HeaderOf(const std::string& header, const Part& part) {
  std::string result;
  bool is_kept = true;
  for (size_t at = 0; at < header.size();) {
    const size_t end = header.find('\n', at) + 1;
    std::string line = header.substr(at, end - at);
    at = end;
    std::istringstream words(line);
    std::string keyword;
    PlyElement element;
    words >> keyword >> element.name;
    if (keyword == "element") {
      is_kept = IsPlyVertices(element) || IsPlyFaces(element);
      const uint64_t count = IsPlyVertices(element) ? part.vertices : part.faces;
      line = "element " + element.name + " " + std::to_string(count) +
             (line.ends_with("\r\n") ? "\r\n" : "\n");
    }
    if (is_kept || keyword != "element") {
      if (is_kept || keyword != "property") result += line;
    }
  }
  return result;
}

// Appends a corner's index in the encoding of the file.
void AppendIndex(uint32_t index, PlyType type, const std::string& format, std::string* bytes) {
  if (format == "ascii") {
    bytes->append(" ").append(std::to_string(index));
    return;
  }
  const size_t at = bytes->size();
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      AppendBinary(static_cast<uint8_t>(index), bytes);
      break;
    case PlyType::kInt16:
    case PlyType::kUint16:
      AppendBinary(static_cast<uint16_t>(index), bytes);
      break;
    case PlyType::kInt32:
    case PlyType::kUint32:
      AppendBinary(index, bytes);
      break;
    case PlyType::kFloat:
      AppendBinary(static_cast<float>(index), bytes);
      break;
    case PlyType::kDouble:
      AppendBinary(static_cast<double>(index), bytes);
      break;
  }
  if (format == "binary_big_endian") std::reverse(bytes->begin() + at, bytes->end());
}

// Copies the records of both elements to the parts that they belong to.
class Splitter {
 public:
  Splitter(const PolygonMesh& mesh,
           const std::vector<uint32_t>& part_of_face,
           const std::vector<Use>& uses,
           std::vector<Part>* parts)
      : mesh_(mesh), part_of_face_(part_of_face), uses_(uses), parts_(*parts) {}

  void CopyVertices(const PlyElement& element, PlyReader* reader) {
    const size_t last = element.properties.size() - 1;
    std::string record;
    auto use = uses_.begin();
    reader->ReadRecords(
        element,
        [](uint64_t, size_t, double) {},
        [&](uint64_t v, size_t column) {
          if (column != last) return;
          record.clear();
          reader->TakeBytes(&record);
          for (; use != uses_.end() && use->vertex == v; ++use) {
            Write(reader, record, &parts_[use->part]);
          }
        });
  }

  void CopyFaces(const PlyElement& element, PlyReader* reader) {
    const size_t last = element.properties.size() - 1;
    const size_t corners = FindCornerColumn(*reader, element);
    const PlyProperty& list = element.properties[corners];
    const std::string& format = reader->header().format;
    std::string record;
    reader->ReadRecords(
        element,
        [](uint64_t, size_t, double) {},
        [&](uint64_t f, size_t column) {
          const size_t before = record.size();
          reader->TakeBytes(&record);
          const bool is_copied = part_of_face_[f] < parts_.size();
          if (column == corners && is_copied) {
            // What counts the corners stays.
            record.resize(format == "ascii" ? EndOfWord(record, before)
                                            : before + BytesOf(list.count_type));
            for (const uint32_t corner : mesh_.Face(f)) {
              AppendIndex(IndexIn(part_of_face_[f], corner), list.type, format, &record);
            }
          }
          if (column != last) return;
          if (is_copied) Write(reader, record, &parts_[part_of_face_[f]]);
          record.clear();
        });
  }

 private:
  // In text, the line's end before a record that is the first of its part is in the way: the
  // header has one.
  static void Write(PlyReader* reader, const std::string& record, Part* part) {
    if (reader->header().format != "ascii") {
      part->out->Text(record);
      return;
    }
    const size_t word = std::min(record.find_first_not_of(" \t\n\v\f\r"), record.size());
    part->out->Text(record.substr(word) + "\n");
  }

  static size_t EndOfWord(const std::string& text, size_t from) {
    const size_t word = std::min(text.find_first_not_of(" \t\n\v\f\r", from), text.size());
    return std::min(text.find_first_of(" \t\n\v\f\r", word), text.size());
  }

  uint32_t IndexIn(uint32_t part, uint32_t vertex) const {
    const auto found = std::lower_bound(
        uses_.begin(), uses_.end(), std::pair(vertex, part), [](const Use& use, const auto& key) {
          return std::pair(use.vertex, use.part) < key;
        });
    CHECK(found != uses_.end() && found->vertex == vertex && found->part == part);
    return found->index;
  }

  const PolygonMesh& mesh_;
  const std::vector<uint32_t>& part_of_face_;
  const std::vector<Use>& uses_;
  std::vector<Part>& parts_;
};

}  // namespace

std::vector<WrittenFile> SplitLabelledPly(const fs::path& labelled,
                                          const fs::path& folder,
                                          const std::vector<Label>& labels) {
  const PolygonMesh mesh = ReadPolygonMesh(labelled);
  RequireValidMesh(labelled, mesh);
  const std::vector<LabelId> vertex_labels = ReadLabels(labelled, IsPlyVertices);
  const std::vector<LabelId> face_labels = ReadLabels(labelled, IsPlyFaces);
  const std::vector<LabelId>& splitting = mesh.NumFaces() > 0 ? face_labels : vertex_labels;
  std::map<LabelId, uint32_t> part_of;
  for (const LabelId id : splitting) {
    if (id != kNoObject) part_of.emplace(id, 0);
  }
  std::vector<Part> parts(part_of.size());
  std::vector<WrittenFile> files;
  for (auto& [id, part] : part_of) {
    part = static_cast<uint32_t>(files.size());
    std::string name;
    for (const Label& label : labels) {
      if (label.id == id) name = label.name;
    }
    files.push_back({id, "ply", "objects/" + FileStem(id, name) + ".ply", ""});
    parts[part].out = std::make_unique<ByteWriter>(folder / files.back().path);
  }
  const auto parts_of = [&](const std::vector<LabelId>& ids) {
    std::vector<uint32_t> result;
    result.reserve(ids.size());
    for (const LabelId id : ids) {
      const auto found = part_of.find(id);
      result.push_back(found == part_of.end() ? static_cast<uint32_t>(parts.size())
                                              : found->second);
    }
    return result;
  };
  const std::vector<uint32_t> part_of_vertex = parts_of(vertex_labels);
  const std::vector<uint32_t> part_of_face = parts_of(face_labels);
  const std::vector<Use> uses = UsesOf(mesh, part_of_vertex, part_of_face, &parts);

  PlyReader reader(labelled, "a labelled PLY");
  reader.KeepBytes();
  std::string header;
  reader.TakeBytes(&header);
  for (Part& part : parts) part.out->Text(HeaderOf(header, part));
  Splitter splitter(mesh, part_of_face, uses, &parts);
  for (const PlyElement& element : reader.header().elements) {
    if (IsPlyVertices(element) && element.count > 0) {
      splitter.CopyVertices(element, &reader);
    } else if (IsPlyFaces(element) && element.count > 0) {
      splitter.CopyFaces(element, &reader);
    } else {
      std::string skipped;
      reader.ReadRecords(
          element,
          [](uint64_t, size_t, double) {},
          [&](uint64_t, size_t) {
            skipped.clear();
            reader.TakeBytes(&skipped);
          });
    }
  }
  for (size_t part = 0; part < parts.size(); ++part) {
    parts[part].out->Finish();
    files[part].summary =
        std::to_string(parts[part].vertices) +
        (mesh.NumFaces() > 0 ? " vertices, " + std::to_string(parts[part].faces) + " faces"
                             : " points");
  }
  return files;
}

}  // namespace semfoam
