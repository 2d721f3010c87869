// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/las_labels.h"

#include "export/io/byte_writer.h"
#include "export/transfer/value_at.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <array>
#include <string>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kWhat[] = "a LAS";
constexpr uint64_t kBlockPoints = uint64_t{1} << 16;
// Where the header has what (LAS 1.4 R15, table 3).
constexpr size_t kVersionAt = 24, kFirstPointAt = 96, kFormatAt = 104, kRecordAt = 105,
                 kOldCountAt = 107, kScaleAt = 131, kOffsetAt = 155, kCountAt = 247;
constexpr size_t kOldHeader = 227, kHeader = 375;
// The bytes of a point by format; more may follow.
constexpr std::array<size_t, 11> kRecordBytes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
// LASzip sets these bits of the format.
constexpr int kCompressed = 0xc0;

Eigen::Vector3d VectorAt(std::string_view bytes, size_t at) {
  return {
      ValueAt<double>(bytes, at), ValueAt<double>(bytes, at + 8), ValueAt<double>(bytes, at + 16)};
}

Eigen::Vector3d PlaceOf(std::string_view record, const LasHeader& header) {
  const Eigen::Vector3d stored(
      ValueAt<int32_t>(record, 0), ValueAt<int32_t>(record, 4), ValueAt<int32_t>(record, 8));
  return header.scale.cwiseProduct(stored) + header.offset;
}

void SetClass(uint8_t to, const LasHeader& header, char* record) {
  if (header.format < 6) {
    record[15] = static_cast<char>((record[15] & 0xe0) | to);
  } else {
    record[16] = static_cast<char>(to);
  }
}

// Calls `take(bytes)` with the records of a block after another. The file is behind its header.
template <typename Take>
void ForEachBlock(const fs::path& path,
                  const LasHeader& header,
                  InputFile* file,
                  const Take& take) {
  std::string bytes;
  for (uint64_t first = 0; first < header.num_points; first += kBlockPoints) {
    bytes.resize(std::min(kBlockPoints, header.num_points - first) * header.record_bytes);
    if (file->Read(bytes.data(), bytes.size()) < bytes.size()) {
      throw UserError(path.string(), ": has become shorter while it was read.");
    }
    take(first, &bytes);
  }
}

// Calls `take(bytes)` with pieces of the next `count` bytes, or of all up to the end.
template <typename Take>
void ForEachPiece(uint64_t count, InputFile* file, const Take& take) {
  std::string bytes;
  while (count > 0) {
    bytes.resize(std::min<uint64_t>(count, 1 << 20));
    bytes.resize(file->Read(bytes.data(), bytes.size()));
    if (bytes.empty()) return;
    take(bytes);
    count -= bytes.size();
  }
}

}  // namespace

bool IsLas(std::string_view head) { return head.starts_with("LASF"); }

LasHeader ReadLasHeader(const fs::path& path) {
  InputFile file(path, kWhat);
  std::string head(kHeader, '\0');
  head.resize(file.Read(head.data(), head.size()));
  if (!IsLas(head)) throw UserError(path.string(), ": is no LAS: it does not begin with 'LASF'.");
  if (head.size() < kOldHeader) {
    throw UserError(path.string(), ": ends within its header; is the copy complete?");
  }
  const int minor = static_cast<uint8_t>(head[kVersionAt + 1]);
  if (head[kVersionAt] != 1 || minor > 4) {
    throw UserError(path.string(),
                    ": is a LAS of version ",
                    static_cast<int>(static_cast<uint8_t>(head[kVersionAt])),
                    ".",
                    minor,
                    "; 1.0 to 1.4 are read.");
  }
  LasHeader header;
  header.format = static_cast<uint8_t>(head[kFormatAt]);
  if ((header.format & kCompressed) != 0) {
    throw UserError(path.string(),
                    ": is compressed (LAZ), which is not read; save it as LAS, for example with "
                    "laszip or PDAL.");
  }
  header.record_bytes = ValueAt<uint16_t>(head, kRecordAt);
  if (header.format >= std::ssize(kRecordBytes) ||
      header.record_bytes < kRecordBytes[static_cast<size_t>(header.format)]) {
    throw UserError(path.string(),
                    ": has points of format ",
                    header.format,
                    " with ",
                    header.record_bytes,
                    " bytes each; formats 0 to 10 are read, with the bytes that they need.");
  }
  header.first_byte = ValueAt<uint32_t>(head, kFirstPointAt);
  header.num_points = ValueAt<uint32_t>(head, kOldCountAt);
  if (minor == 4) {
    if (head.size() < kHeader) {
      throw UserError(path.string(), ": ends within its header; is the copy complete?");
    }
    header.num_points = ValueAt<uint64_t>(head, kCountAt);
  }
  header.scale = VectorAt(head, kScaleAt);
  header.offset = VectorAt(head, kOffsetAt);
  if (!header.scale.allFinite() || !header.offset.allFinite() || header.scale.minCoeff() <= 0) {
    throw UserError(path.string(),
                    ": has a scale or an offset of coordinates that is none; is it damaged?");
  }
  const uint64_t room =
      file.size() < header.first_byte ? 0 : (file.size() - header.first_byte) / header.record_bytes;
  if (header.first_byte < (minor == 4 ? kHeader : kOldHeader) || header.num_points > room) {
    throw UserError(path.string(),
                    ": its header says ",
                    header.num_points,
                    " points from byte ",
                    header.first_byte,
                    " on, but there is room for ",
                    room,
                    "; is the copy complete?");
  }
  if (header.num_points == 0) {
    throw UserError(path.string(), ": has no points; a point cloud is needed.");
  }
  return header;
}

PolygonMesh ReadLasPoints(const fs::path& path) {
  const LasHeader header = ReadLasHeader(path);
  InputFile file(path, kWhat);
  ForEachPiece(header.first_byte, &file, [](const std::string&) {});
  PolygonMesh cloud;
  cloud.vertices.reserve(header.num_points);
  ForEachBlock(path, header, &file, [&](uint64_t, const std::string* bytes) {
    for (size_t at = 0; at < bytes->size(); at += header.record_bytes) {
      cloud.vertices.push_back(PlaceOf(std::string_view(*bytes).substr(at), header));
    }
  });
  return cloud;
}

LasClasses ClassesOf(const fs::path& path,
                     const LasHeader& header,
                     const std::vector<Label>& labels) {
  std::vector<int32_t> ids;
  for (const Label& label : labels) {
    if (label.id != kNoObject) ids.push_back(Value(label.id));
  }
  std::sort(ids.begin(), ids.end());
  if (std::ssize(ids) > header.MaxClass()) {
    throw UserError(
        path.string(),
        ": its points (format ",
        header.format,
        ") can have ",
        header.MaxClass(),
        " classes, but there are ",
        ids.size(),
        " labels; ",
        header.format < 6 ? "save it with point format 6, which has 255." : "give it as PLY.");
  }
  const bool are_classes = ids.empty() || ids.back() <= header.MaxClass();
  LasClasses classes;
  for (size_t k = 0; k < ids.size(); ++k) {
    classes[LabelId{ids[k]}] = static_cast<uint8_t>(are_classes ? ids[k] : static_cast<int>(k) + 1);
  }
  return classes;
}

void CopyLasWithLabels(const fs::path& input,
                       const fs::path& output,
                       const LasClasses& classes,
                       const LabelPlyBlock& label_points,
                       const std::function<void()>& check) {
  const LasHeader header = ReadLasHeader(input);
  InputFile file(input, kWhat);
  ByteWriter out(output);
  const auto write = [&](const std::string& bytes) { out.Text(bytes); };
  ForEachPiece(header.first_byte, &file, write);
  std::vector<Eigen::Vector3d> places;
  std::vector<SurfaceLabel> labels;
  ForEachBlock(input, header, &file, [&](uint64_t first, std::string* bytes) {
    places.clear();
    for (size_t at = 0; at < bytes->size(); at += header.record_bytes) {
      places.push_back(PlaceOf(std::string_view(*bytes).substr(at), header));
    }
    labels.assign(places.size(), {});
    label_points({first, places, {}}, labels);
    for (size_t k = 0; k < labels.size(); ++k) {
      const auto found = classes.find(labels[k].id);
      SetClass(found == classes.end() ? uint8_t{0} : found->second,
               header,
               bytes->data() + k * header.record_bytes);
    }
    write(*bytes);
  });
  ForEachPiece(UINT64_MAX, &file, write);
  check();
  out.Finish();
}

}  // namespace semfoam
