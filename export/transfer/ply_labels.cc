// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/ply_labels.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kBlockRecords = uint64_t{1} << 16;
constexpr char kBlanks[] = " \t\n\v\f\r";

bool IsOurs(const PlyProperty& property) {
  return property.name == "label" || property.name == "confidence";
}

bool IsLabelled(const PlyElement& element) { return IsPlyVertices(element) || IsPlyFaces(element); }

// Returns whether a line of a header is a comment of an earlier copy.
bool IsOurComment(const std::string& line) {
  std::istringstream words(line);
  std::string comment, label, id;
  return words >> comment >> label >> id && comment == "comment" && label == "label" &&
         id.find_first_not_of("0123456789") == std::string::npos;
}

// Returns a header with our properties and comments instead of those that it has.
std::string HeaderWithLabels(const std::string& header, const std::vector<Label>& labels) {
  const std::string line_end = header.starts_with("ply\r\n") ? "\r\n" : "\n";
  std::string result;
  bool in_labelled = false;
  for (size_t at = 0; at < header.size();) {
    const size_t end = header.find('\n', at) + 1;
    const std::string line = header.substr(at, end - at);
    at = end;
    std::istringstream words(line);
    std::string keyword;
    PlyElement element;
    words >> keyword;
    if (keyword == "element" || keyword == "end_header") {
      if (in_labelled) {
        result += "property int label" + line_end + "property float confidence" + line_end;
      }
      words >> element.name;
      in_labelled = IsLabelled(element);
    } else if (keyword == "property" && in_labelled) {
      PlyProperty property;
      while (words >> property.name) {
      }
      if (IsOurs(property)) continue;
    } else if (IsOurComment(line)) {
      continue;
    }
    result += line;
    if (keyword != "format") continue;
    result += PlyLabelComments(labels, line_end);
  }
  return result;
}

// Appends our two properties to a record.
class LabelEncoder {
 public:
  explicit LabelEncoder(const PlyHeader& header)
      : is_text_(header.format == "ascii"), is_big_endian_(header.format == "binary_big_endian") {}

  bool is_text() const { return is_text_; }

  void Append(const SurfaceLabel& label, std::string* record) const {
    if (is_text_) {
      char digits[32];
      const auto end = std::to_chars(digits, digits + sizeof(digits), label.confidence).ptr;
      record->append(" ").append(std::to_string(Value(label.id))).append(" ").append(digits, end);
      return;
    }
    const size_t at = record->size();
    AppendBinary(Value(label.id), record);
    AppendBinary(label.confidence, record);
    if (!is_big_endian_) return;
    std::reverse(record->begin() + at, record->begin() + at + sizeof(int32_t));
    std::reverse(record->begin() + at + sizeof(int32_t), record->end());
  }

 private:
  const bool is_text_;
  const bool is_big_endian_;
};

// The records of an element that are read and not yet written.
class RecordBlock {
 public:
  RecordBlock(const LabelPlyBlock& label, const LabelEncoder& encoder, ByteWriter* out)
      : label_(label), encoder_(encoder), out_(out) {}

  std::string* bytes() { return &bytes_; }
  Eigen::Vector3d* position() { return &positions_.back(); }
  Eigen::Vector3f* normal() { return &normals_.back(); }

  void Begin(bool has_position, bool has_normal) {
    if (has_position) positions_.emplace_back(0, 0, 0);
    if (has_normal) normals_.emplace_back(0, 0, 0);
  }

  void End() {
    ends_.push_back(bytes_.size());
    if (ends_.size() == kBlockRecords) Write();
  }

  // Labels and writes all records.
  void Write() {
    std::vector<SurfaceLabel> labels(ends_.size());
    label_({first_, positions_, normals_}, labels);
    std::string record;
    for (size_t i = 0, begin = 0; i < ends_.size(); begin = ends_[i++]) {
      record.assign(bytes_, begin, ends_[i] - begin);
      encoder_.Append(labels[i], &record);
      out_->Text(record);
    }
    first_ += ends_.size();
    bytes_.clear();
    ends_.clear();
    positions_.clear();
    normals_.clear();
  }

 private:
  const LabelPlyBlock& label_;
  const LabelEncoder& encoder_;
  ByteWriter* const out_;
  uint64_t first_ = 0;
  std::string bytes_;
  // [records] Where each ends in `bytes_`.
  std::vector<size_t> ends_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<Eigen::Vector3f> normals_;
};

// Drops what a property of ours had, but for the line's end before it, in text.
void DropNumber(size_t begin, bool is_text, std::string* bytes) {
  size_t kept = begin;
  if (is_text) {
    const size_t word = std::min(bytes->find_first_not_of(kBlanks, begin), bytes->size());
    if (bytes->find('\n', begin) < word) kept = word;
  }
  bytes->resize(kept);
}

void CopyLabelled(const PlyElement& element,
                  const LabelPlyBlock& label,
                  const LabelEncoder& encoder,
                  PlyReader* reader,
                  ByteWriter* out) {
  constexpr size_t kNone = std::numeric_limits<size_t>::max();
  PlyVertexColumns columns = {{kNone, kNone, kNone}, {}};
  const bool has_position = IsPlyVertices(element);
  if (has_position) {
    columns = FindVertexColumns(*reader, element);
  } else {
    FindCornerColumn(*reader, element);
  }
  const bool has_normal = columns.normal.has_value();
  const std::array<size_t, 3> normal = columns.normal.value_or(columns.position);
  std::vector<uint8_t> is_ours;
  for (const PlyProperty& property : element.properties) is_ours.push_back(IsOurs(property));
  const size_t last = element.properties.size() - 1;
  const bool drops = std::count(is_ours.begin(), is_ours.end(), 1) > 0;

  RecordBlock block(label, encoder, out);
  uint64_t begun = kNone;
  const auto begin = [&](uint64_t record) {
    if (record == begun) return;
    block.Begin(has_position, has_normal);
    begun = record;
  };
  reader->ReadRecords(
      element,
      [&](uint64_t record, size_t column, double value) {
        if (!has_position) return;
        begin(record);
        for (int axis = 0; axis < 3; ++axis) {
          if (column == columns.position[axis]) (*block.position())[axis] = value;
          if (has_normal && column == normal[axis]) {
            (*block.normal())[axis] = static_cast<float>(value);
          }
        }
      },
      [&](uint64_t record, size_t column) {
        begin(record);
        if (!drops && column != last) return;
        const size_t before = block.bytes()->size();
        reader->TakeBytes(block.bytes());
        if (is_ours[column]) DropNumber(before, encoder.is_text(), block.bytes());
        if (column == last) block.End();
      });
  block.Write();
}

// Copies the bytes that the reader has read since the last call.
void CopyRead(PlyReader* reader, ByteWriter* out) {
  std::string bytes;
  reader->TakeBytes(&bytes);
  out->Text(bytes);
}

}  // namespace

std::string PlyLabelComments(const std::vector<Label>& labels, const std::string& line_end) {
  std::string comments;
  for (const Label& label : labels) {
    if (label.id == kNoObject) continue;
    comments += "comment label " + std::to_string(Value(label.id)) + " " +
                OneLine(DisplayName(label.id, label.name)) + line_end;
  }
  return comments;
}

void CopyPlyWithLabels(const fs::path& input,
                       const fs::path& output,
                       const std::vector<Label>& labels,
                       const LabelPlyBlock& label_vertices,
                       const LabelPlyBlock& label_faces,
                       const std::function<void()>& check) {
  PlyReader reader(input, "a PLY of points or faces");
  reader.KeepBytes();
  ByteWriter out(output);
  std::string header;
  reader.TakeBytes(&header);
  out.Text(HeaderWithLabels(header, labels));
  const LabelEncoder encoder(reader.header());
  for (const PlyElement& element : reader.header().elements) {
    reader.RequireRoomFor(element);
    if (IsLabelled(element) && element.count > 0) {
      CopyLabelled(
          element, IsPlyVertices(element) ? label_vertices : label_faces, encoder, &reader, &out);
      continue;
    }
    reader.ReadRecords(
        element,
        [](uint64_t, size_t, double) {},
        [&](uint64_t record, size_t column) {
          if (record % kBlockRecords == 0 && column == 0) CopyRead(&reader, &out);
        });
    CopyRead(&reader, &out);
  }
  while (reader.SkipBytes()) CopyRead(&reader, &out);
  check();
  out.Finish();
}

}  // namespace semfoam
