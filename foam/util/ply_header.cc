// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/ply_header.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// A header is some hundred bytes; what has no end within this is none.
constexpr size_t kMaxHeaderBytes = 1 << 16;

std::optional<PlyType> TypeNamed(std::string_view name) {
  struct Type {
    std::string_view name;
    std::string_view sized_name;
    PlyType type;
  };
  constexpr Type kTypes[] = {{"char", "int8", PlyType::kInt8},
                             {"uchar", "uint8", PlyType::kUint8},
                             {"short", "int16", PlyType::kInt16},
                             {"ushort", "uint16", PlyType::kUint16},
                             {"int", "int32", PlyType::kInt32},
                             {"uint", "uint32", PlyType::kUint32},
                             {"float", "float32", PlyType::kFloat},
                             {"double", "float64", PlyType::kDouble}};
  for (const Type& known : kTypes) {
    if (known.name == name || known.sized_name == name) return known.type;
  }
  return std::nullopt;
}

template <typename T>
double Load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

// Returns the header's lines without their ends, and where the data begins.
std::vector<std::string> HeaderLines(const fs::path& path,
                                     const std::string& bytes,
                                     const std::string& wanted,
                                     size_t* data) {
  if (bytes.rfind("ply\n", 0) != 0 && bytes.rfind("ply\r\n", 0) != 0) {
    throw UserError(path.string(),
                    ": is no PLY file: it does not begin with 'ply'; ",
                    wanted,
                    " would be right.");
  }
  std::vector<std::string> lines;
  size_t at = 0;
  while (at < std::min(bytes.size(), kMaxHeaderBytes)) {
    const size_t end = bytes.find('\n', at);
    if (end == std::string::npos) break;
    std::string line = bytes.substr(at, end - at);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    at = end + 1;
    if (line == "end_header") {
      *data = at;
      return lines;
    }
    lines.push_back(line);
  }
  throw UserError(path.string(),
                  ": is no whole PLY file: its header has no end_header; is the copy complete?");
}

// Of a line "element NAME COUNT"; false where it is none.
bool ReadElement(std::istringstream* words, PlyElement* element) {
  std::string digits;
  *words >> element->name >> digits;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), element->count);
  return error == std::errc() && end == digits.data() + digits.size() && !digits.empty();
}

// Of a line "property TYPE NAME" or "property list TYPE TYPE NAME"; false where it is none.
bool ReadProperty(std::istringstream* words, PlyProperty* property) {
  std::string type;
  *words >> type;
  property->is_list = type == "list";
  if (property->is_list) {
    std::string count_type;
    *words >> count_type >> type;
    const auto known = TypeNamed(count_type);
    if (!known || *known == PlyType::kFloat || *known == PlyType::kDouble) return false;
    property->count_type = *known;
  }
  *words >> property->name;
  const auto known = TypeNamed(type);
  if (known) property->type = *known;
  return known && !property->name.empty();
}

}  // namespace

size_t BytesOf(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat:
      return 4;
    case PlyType::kDouble:
      return 8;
  }
  LOG(FATAL) << "no type of a PLY";
}

double LoadAs(PlyType type, const char* bytes) {
  switch (type) {
    case PlyType::kInt8:
      return Load<int8_t>(bytes);
    case PlyType::kUint8:
      return Load<uint8_t>(bytes);
    case PlyType::kInt16:
      return Load<int16_t>(bytes);
    case PlyType::kUint16:
      return Load<uint16_t>(bytes);
    case PlyType::kInt32:
      return Load<int32_t>(bytes);
    case PlyType::kUint32:
      return Load<uint32_t>(bytes);
    case PlyType::kFloat:
      return Load<float>(bytes);
    case PlyType::kDouble:
      return Load<double>(bytes);
  }
  LOG(FATAL) << "no type of a PLY";
}

PlyHeader ParsePlyHeader(const fs::path& path,
                         const std::string& bytes,
                         const std::string& wanted) {
  PlyHeader header;
  for (const std::string& line : HeaderLines(path, bytes, wanted, &header.data)) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "ply" || keyword == "comment" || keyword == "obj_info" || keyword.empty()) {
      continue;
    }
    if (keyword == "format") {
      words >> header.format;
      continue;
    }
    const auto named = [](const auto& list, const std::string& name) {
      return std::any_of(
          list.begin(), list.end(), [&](const auto& known) { return known.name == name; });
    };
    PlyElement element;
    PlyProperty property;
    property.line = line;
    if (keyword == "element" && ReadElement(&words, &element) &&
        !named(header.elements, element.name)) {
      header.elements.push_back(element);
    } else if (keyword == "property" && !header.elements.empty() &&
               ReadProperty(&words, &property) &&
               !named(header.elements.back().properties, property.name)) {
      header.elements.back().properties.push_back(property);
    } else {
      throw UserError(
          path.string(),
          ": has a line in its header that is not understood, '",
          Shortened(line),
          "'; 'element NAME COUNT', 'property TYPE NAME', each name once, would be right.");
    }
  }
  return header;
}

}  // namespace semfoam
