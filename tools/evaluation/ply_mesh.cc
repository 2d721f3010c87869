// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/ply_mesh.h"

#include "export/io/ply_header.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <system_error>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The numbers after the header, one by one.
class Numbers {
 public:
  Numbers(const fs::path& path, const std::string& bytes, const PlyHeader& header)
      : path_(path), bytes_(bytes), at_(header.data) {
    is_text_ = header.format == "ascii";
    is_big_endian_ = header.format == "binary_big_endian";
    if (is_text_ || is_big_endian_ || header.format == "binary_little_endian") return;
    throw UserError(path.string(),
                    ": is a PLY of format ",
                    header.format.empty() ? "none" : Shortened(header.format),
                    "; ascii, binary_little_endian and binary_big_endian are what can be read.");
  }

  // For sentences: which of how many of what is read.
  void Enter(const PlyElement& element, uint64_t record) {
    element_ = &element;
    record_ = record;
  }

  double Next(const PlyProperty& property, PlyType type) {
    if (is_text_) return NextWord(property);
    const size_t size = BytesOf(type);
    if (size > bytes_.size() - at_) ThrowEnd();
    char value[8];
    std::copy_n(bytes_.data() + at_, size, value);
    if (is_big_endian_) std::reverse(value, value + size);
    at_ += size;
    return LoadAs(type, value);
  }

  // The length of a list, for which there are bytes.
  size_t NextLength(const PlyProperty& property) {
    const double length = Next(property, property.count_type);
    const size_t least = is_text_ ? 1 : BytesOf(property.type);
    const uint64_t most = (bytes_.size() - at_) / least;
    const bool is_whole = length == std::floor(length) && std::abs(length) < 1e15;
    if (is_whole && length >= 0 && length <= static_cast<double>(most)) {
      return static_cast<size_t>(length);
    }
    throw UserError(path_.string(),
                    ": has a list of ",
                    is_whole ? std::to_string(std::llround(length)) : FormatNumber(length),
                    " ",
                    Shortened(property.name),
                    ", of which at most ",
                    most,
                    " can follow; is it damaged?");
  }

 private:
  double NextWord(const PlyProperty& property) {
    constexpr std::string_view kBlanks = " \t\r\n\v\f";
    const size_t begin = bytes_.find_first_not_of(kBlanks, at_);
    if (begin == std::string::npos) ThrowEnd();
    at_ = std::min(bytes_.find_first_of(kBlanks, begin), bytes_.size());
    const char* const end = bytes_.data() + at_;
    const char* from = bytes_.data() + begin;
    if (*from == '+') ++from;
    double value = 0;
    const auto [stop, error] = std::from_chars(from, end, value);
    if (error == std::errc() && stop == end) return value;
    throw UserError(path_.string(),
                    ": has '",
                    Shortened({bytes_.data() + begin, at_ - begin}),
                    "' where a number should be, ",
                    Shortened(property.name),
                    " of ",
                    Shortened(element_->name),
                    "; is it damaged?");
  }

  [[noreturn]] void ThrowEnd() const {
    throw UserError(path_.string(),
                    ": ends too early: its header says ",
                    element_->count,
                    " of ",
                    Shortened(element_->name),
                    ", of which there are ",
                    record_,
                    "; is the copy complete?");
  }

  const fs::path& path_;
  const std::string& bytes_;
  size_t at_;
  bool is_text_ = false;
  bool is_big_endian_ = false;
  const PlyElement* element_ = nullptr;
  uint64_t record_ = 0;
};

// Returns the place of the property in the element's records. Throws UserError where it has none,
// or one of another kind.
size_t Find(const fs::path& path,
            const PlyElement& element,
            std::initializer_list<std::string_view> names,
            bool is_list) {
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (property.is_list != is_list) continue;
    if (std::find(names.begin(), names.end(), property.name) != names.end()) return i;
  }
  throw UserError(path.string(),
                  ": has no ",
                  is_list ? "list " : "property ",
                  *names.begin(),
                  " of ",
                  Shortened(element.name),
                  ", which should be there; is it of another program?");
}

size_t CornerOf(double value) {
  constexpr double kMost = 1e15;  // below, doubles are exact
  return value >= 0 && value < kMost && value == std::floor(value) ? static_cast<size_t>(value)
                                                                   : SIZE_MAX;
}

// Calls `take` with the number of the record, the column and the value, for every number of the
// element in the order of the file.
template <typename Take>
void ReadRecords(const PlyElement& element, Numbers* numbers, const Take& take) {
  if (element.properties.empty()) return;  // however many
  for (uint64_t i = 0; i < element.count; ++i) {
    numbers->Enter(element, i);
    for (size_t column = 0; column < element.properties.size(); ++column) {
      const PlyProperty& property = element.properties[column];
      const size_t length = property.is_list ? numbers->NextLength(property) : 1;
      for (size_t k = 0; k < length; ++k) take(i, column, numbers->Next(property, property.type));
    }
  }
}

}  // namespace

PolygonSoup ReadPlyMesh(const fs::path& path) {
  const std::string bytes = ReadFileBytes(path, "a PLY file");
  const PlyHeader header = ParsePlyHeader(path, bytes, "a PLY of points or faces");
  Numbers numbers(path, bytes, header);
  PolygonSoup mesh;
  for (const PlyElement& element : header.elements) {
    if (element.count > 0 && (element.name == "vertex" || element.name == "vertices")) {
      const size_t columns[] = {Find(path, element, {"x"}, /*is_list=*/false),
                                Find(path, element, {"y"}, /*is_list=*/false),
                                Find(path, element, {"z"}, /*is_list=*/false)};
      const size_t first_vertex = mesh.vertices.size();
      ReadRecords(element, &numbers, [&](uint64_t i, size_t column, double value) {
        if (first_vertex + i == mesh.vertices.size()) mesh.vertices.emplace_back(0, 0, 0);
        for (int axis = 0; axis < 3; ++axis) {
          if (column == columns[axis]) mesh.vertices.back()[axis] = value;
        }
      });
    } else if (element.count > 0 && (element.name == "face" || element.name == "faces")) {
      const size_t corners =
          Find(path, element, {"vertex_indices", "vertex_index"}, /*is_list=*/true);
      uint64_t face = element.count;  // none yet
      ReadRecords(element, &numbers, [&](uint64_t i, size_t column, double value) {
        if (column != corners) return;
        if (i != face) mesh.faces.emplace_back();
        face = i;
        mesh.faces.back().push_back(CornerOf(value));
      });
    } else {
      ReadRecords(element, &numbers, [](uint64_t, size_t, double) {});
    }
  }
  return mesh;
}

}  // namespace semfoam
