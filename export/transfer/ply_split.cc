// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/ply_split.h"

#include "export/io/byte_writer.h"
#include "export/transfer/boundary_caps.h"
#include "export/transfer/mesh_parts.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/util/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

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
  uint64_t caps = 0;
  std::unique_ptr<ByteWriter> out;
};

// A vertex in a part, and its index there.
struct Use {
  uint32_t vertex = 0;
  uint32_t part = 0;
  uint32_t index = 0;
};

// Returns the vertices of each part, by ascending vertex; counts them in `parts`. part_of: [faces],
// or of a cloud [points].
std::vector<Use> UsesOf(const PolygonMesh& mesh,
                        const std::vector<uint32_t>& part_of,
                        std::vector<Part>* parts) {
  const uint32_t none = static_cast<uint32_t>(parts->size());
  std::vector<Use> uses;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    if (part_of[f] == none) continue;
    ++(*parts)[part_of[f]].faces;
    for (const uint32_t corner : mesh.Face(f)) uses.push_back({corner, part_of[f], 0});
  }
  if (mesh.NumFaces() == 0) {
    for (uint32_t v = 0; v < part_of.size(); ++v) {
      if (part_of[v] != none) uses.push_back({v, part_of[v], 0});
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

// Appends a number in the encoding of the file.
template <typename T>
void AppendNumber(T number, PlyType type, const std::string& format, std::string* bytes) {
  if (format == "ascii") {
    char digits[32];
    const auto end =
        type == PlyType::kFloat
            ? std::to_chars(digits, digits + sizeof(digits), static_cast<float>(number))
            : std::to_chars(digits, digits + sizeof(digits), number);
    bytes->append(" ").append(digits, end.ptr);
    return;
  }
  const size_t at = bytes->size();
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      AppendBinary(static_cast<uint8_t>(number), bytes);
      break;
    case PlyType::kInt16:
    case PlyType::kUint16:
      AppendBinary(static_cast<uint16_t>(number), bytes);
      break;
    case PlyType::kInt32:
    case PlyType::kUint32:
      AppendBinary(static_cast<uint32_t>(static_cast<int64_t>(number)), bytes);
      break;
    case PlyType::kFloat:
      AppendBinary(static_cast<float>(number), bytes);
      break;
    case PlyType::kDouble:
      AppendBinary(static_cast<double>(number), bytes);
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
           const std::vector<BoundaryCap>& caps,
           std::vector<Part>* parts)
      : mesh_(mesh),
        part_of_face_(part_of_face),
        uses_(uses),
        caps_(caps),
        vertex_records_(caps.size()),
        face_records_(caps.size()),
        parts_(*parts) {
    // Centres follow the other vertices of their part.
    std::vector<uint32_t> next;
    for (const Part& part : parts_) next.push_back(part.vertices);
    for (const BoundaryCap& cap : caps_) next[cap.part] -= cap.HasCenter();
    for (const BoundaryCap& cap : caps_) {
      caps_of_vertex_.emplace(cap.loop[0], centers_.size());
      caps_of_face_.emplace(cap.face, centers_.size());
      centers_.push_back(next[cap.part]);
      next[cap.part] += cap.HasCenter();
    }
  }

  void CopyVertices(const PlyElement& element, PlyReader* reader) {
    const size_t last = element.properties.size() - 1;
    const std::array<size_t, 3> position = FindVertexColumns(*reader, element).position;
    const std::string& format = reader->header().format;
    std::string record;
    std::vector<size_t> ends;  // of the properties in the record
    auto use = uses_.begin();
    reader->ReadRecords(
        element,
        [](uint64_t, size_t, double) {},
        [&](uint64_t v, size_t column) {
          if (column == 0) {
            record.clear();
            ends = {0};
          }
          reader->TakeBytes(&record);
          ends.push_back(record.size());
          if (column != last) return;
          const auto [begin, end] = caps_of_vertex_.equal_range(static_cast<uint32_t>(v));
          for (auto cap = begin; cap != end; ++cap) {
            vertex_records_[cap->second] =
                CenterRecord(caps_[cap->second], element, position, record, ends, format);
          }
          for (; use != uses_.end() && use->vertex == v; ++use) {
            Write(reader, record, &parts_[use->part]);
          }
        });
    for (size_t cap = 0; cap < caps_.size(); ++cap) {
      if (caps_[cap].HasCenter()) Write(reader, vertex_records_[cap], &parts_[caps_[cap].part]);
    }
  }

  void CopyFaces(const PlyElement& element, PlyReader* reader) {
    const size_t last = element.properties.size() - 1;
    const size_t corners = FindCornerColumn(*reader, element);
    const PlyProperty& list = element.properties[corners];
    const std::string& format = reader->header().format;
    std::string record;
    size_t corners_begin = 0, corners_end = 0;
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
              AppendNumber(IndexIn(part_of_face_[f], corner), list.type, format, &record);
            }
            corners_begin = before;
            corners_end = record.size();
          }
          if (column != last) return;
          const auto [begin, end] = caps_of_face_.equal_range(static_cast<uint32_t>(f));
          for (auto cap = begin; cap != end; ++cap) {
            face_records_[cap->second] = {record.substr(0, corners_begin),
                                          record.substr(corners_end)};
          }
          if (is_copied) Write(reader, record, &parts_[part_of_face_[f]]);
          record.clear();
        });
    for (size_t cap = 0; cap < caps_.size(); ++cap) WriteCap(cap, list, reader);
  }

 private:
  // Returns the record of a vertex of the cap's loop with the place of its centre.
  std::string CenterRecord(const BoundaryCap& cap,
                           const PlyElement& element,
                           const std::array<size_t, 3>& position,
                           const std::string& record,
                           const std::vector<size_t>& ends,
                           const std::string& format) const {
    const Eigen::Vector3d center = cap.Center(mesh_);
    std::string result;
    for (size_t column = 0; column < element.properties.size(); ++column) {
      const auto axis = std::find(position.begin(), position.end(), column) - position.begin();
      if (axis < 3) {
        AppendNumber(center[axis], element.properties[column].type, format, &result);
      } else {
        result.append(record, ends[column], ends[column + 1] - ends[column]);
      }
    }
    return result;
  }

  void WriteCap(size_t which, const PlyProperty& list, PlyReader* reader) {
    const BoundaryCap& cap = caps_[which];
    const std::string& format = reader->header().format;
    for (size_t k = 0; k < cap.NumTriangles(); ++k) {
      std::string record = face_records_[which].first;
      AppendNumber(3u, list.count_type, format, &record);
      const uint32_t third = cap.HasCenter() ? centers_[which] : IndexIn(cap.part, cap.loop[2]);
      for (const uint32_t corner : {IndexIn(cap.part, cap.loop[k]),
                                    IndexIn(cap.part, cap.loop[(k + 1) % cap.loop.size()]),
                                    third}) {
        AppendNumber(corner, list.type, format, &record);
      }
      Write(reader, record + face_records_[which].second, &parts_[cap.part]);
    }
  }

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
  const std::vector<BoundaryCap>& caps_;
  // Which caps take their records from a vertex, from a face.
  std::multimap<uint32_t, size_t> caps_of_vertex_, caps_of_face_;
  // [caps] The record of the centre; what stands before and behind the corners of a face; the
  // index of the centre in its part.
  std::vector<std::string> vertex_records_;
  std::vector<std::pair<std::string, std::string>> face_records_;
  std::vector<uint32_t> centers_;
  std::vector<Part>& parts_;
};

}  // namespace

std::vector<WrittenFile> SplitLabelledPly(const fs::path& labelled,
                                          const fs::path& folder,
                                          const std::vector<Label>& labels,
                                          bool cap) {
  const PolygonMesh mesh = ReadPolygonMesh(labelled);
  RequireValidMesh(labelled, mesh);
  const std::vector<LabelId> vertex_labels = ReadLabels(labelled, IsPlyVertices);
  const std::vector<LabelId> face_labels = ReadLabels(labelled, IsPlyFaces);
  const std::vector<LabelId>& splitting = mesh.NumFaces() > 0 ? face_labels : vertex_labels;
  const MeshParts of_splitting = FindMeshParts(splitting);
  std::vector<WrittenFile> files = PartFiles(of_splitting, labels, "ply");
  std::vector<Part> parts(files.size());
  for (size_t part = 0; part < parts.size(); ++part) {
    parts[part].out = std::make_unique<ByteWriter>(folder / files[part].path);
  }
  const std::vector<uint32_t>& part_of_face = of_splitting.part_of;
  const std::vector<Use> uses = UsesOf(mesh, of_splitting.part_of, &parts);
  std::vector<BoundaryCap> caps;
  if (cap) caps = FindBoundaryCaps(mesh, part_of_face, static_cast<uint32_t>(parts.size()));
  for (const BoundaryCap& one : caps) {
    parts[one.part].vertices += one.HasCenter();
    parts[one.part].faces += one.NumTriangles();
    ++parts[one.part].caps;
  }

  PlyReader reader(labelled, "a labelled PLY");
  reader.KeepBytes();
  std::string header;
  reader.TakeBytes(&header);
  for (const PlyElement& element : reader.header().elements) {
    if (caps.empty() || !IsPlyFaces(element) || element.count == 0) continue;
    const size_t size = BytesOf(element.properties[FindCornerColumn(reader, element)].type);
    for (const Part& part : parts) {
      if (size >= 4 || part.vertices <= 1u << (8 * size - 1)) continue;
      throw UserError(labelled.string(),
                      ": its corners are numbers of ",
                      size,
                      " bytes, too short for the vertices that caps add; give a PLY whose list of "
                      "corners is of int.");
    }
  }
  for (Part& part : parts) part.out->Text(HeaderOf(header, part));
  Splitter splitter(mesh, part_of_face, uses, caps, &parts);
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
    files[part].summary = PartSummary(parts[part].vertices, parts[part].faces, parts[part].caps);
  }
  return files;
}

}  // namespace semfoam
