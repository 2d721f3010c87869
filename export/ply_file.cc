// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/ply_file.h"

#include "foam/error.h"
#include "foam/input_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <sstream>
#include <string_view>
#include <system_error>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// A header is some hundred bytes; what has no end within this is none.
constexpr size_t kMaxHeaderBytes = 1 << 16;

// 0 = no such type.
size_t BytesOf(std::string_view type) {
  struct Type {
    std::string_view name;
    size_t bytes;
  };
  constexpr std::array<Type, 16> kTypes = {{{"char", 1},
                                            {"int8", 1},
                                            {"uchar", 1},
                                            {"uint8", 1},
                                            {"short", 2},
                                            {"int16", 2},
                                            {"ushort", 2},
                                            {"uint16", 2},
                                            {"int", 4},
                                            {"int32", 4},
                                            {"uint", 4},
                                            {"uint32", 4},
                                            {"float", 4},
                                            {"float32", 4},
                                            {"double", 8},
                                            {"float64", 8}}};
  for (const Type& known : kTypes) {
    if (known.name == type) return known.bytes;
  }
  return 0;
}

template <typename T>
double Load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

double LoadAs(std::string_view type, const char* bytes) {
  if (type == "char" || type == "int8") return Load<int8_t>(bytes);
  if (type == "uchar" || type == "uint8") return Load<uint8_t>(bytes);
  if (type == "short" || type == "int16") return Load<int16_t>(bytes);
  if (type == "ushort" || type == "uint16") return Load<uint16_t>(bytes);
  if (type == "int" || type == "int32") return Load<int32_t>(bytes);
  if (type == "uint" || type == "uint32") return Load<uint32_t>(bytes);
  if (type == "float" || type == "float32") return Load<float>(bytes);
  CHECK(type == "double" || type == "float64") << type;
  return Load<double>(bytes);
}

// The header's lines without their ends, and where the data begins.
std::vector<std::string> HeaderLines(const fs::path& path, const std::string& bytes, size_t* data) {
  if (bytes.rfind("ply\n", 0) != 0 && bytes.rfind("ply\r\n", 0) != 0) {
    throw UserError(
        path.string(),
        ": is no PLY file: it does not begin with 'ply'; a binary PLY of points would be right.");
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

}  // namespace

PlyFile::PlyFile(const fs::path& path) : path_(path) {
  bytes_ = ReadFileBytes(path, "a PLY file");

  size_t at = 0;
  const auto damaged = [&](const std::string& line) {
    return UserError(
        path.string(),
        ": has a line in its header that is not understood, '",
        Shortened(line),
        "'; 'element NAME COUNT', 'property TYPE NAME', each name once, would be right.");
  };
  for (const std::string& line : HeaderLines(path, bytes_, &at)) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "ply" || keyword == "comment" || keyword == "obj_info" || keyword.empty()) {
      continue;
    }
    if (keyword == "format") {
      std::string encoding;
      words >> encoding;
      if (encoding == "binary_little_endian") continue;
      throw UserError(path.string(),
                      ": is a PLY of format ",
                      Shortened(encoding),
                      "; binary_little_endian is what can be read.");
    }
    std::string name;
    if (keyword == "element") {
      std::string digits;
      words >> name >> digits;
      uint64_t count = 0;
      const auto [end, error] =
          std::from_chars(digits.data(), digits.data() + digits.size(), count);
      if (error != std::errc() || end != digits.data() + digits.size() || digits.empty() ||
          HasElement(name)) {
        throw damaged(line);
      }
      elements_.push_back({name, count, 0, 0, {}});
      continue;
    }
    std::string type;
    words >> type >> name;
    if (keyword != "property" || elements_.empty() || name.empty()) throw damaged(line);
    if (type == "list") {
      throw UserError(path.string(),
                      ": has lists (",
                      Shortened(line),
                      "); a file of points, not of faces, would be right.");
    }
    const size_t size = BytesOf(type);
    Element& element = elements_.back();
    const bool is_twice = std::any_of(element.properties.begin(),
                                      element.properties.end(),
                                      [&](const Property& p) { return p.name == name; });
    if (size == 0 || is_twice) throw damaged(line);
    element.properties.push_back({name, type, element.stride});
    element.stride += size;
  }

  for (Element& element : elements_) {
    element.begin = at;
    const uint64_t left = bytes_.size() - at;
    if (element.stride > 0 && element.count > left / element.stride) {
      throw UserError(path.string(),
                      ": ends too early: its header says ",
                      element.count,
                      " of ",
                      Shortened(element.name),
                      ", of which there are ",
                      left / element.stride,
                      "; is the copy complete?");
    }
    at += element.stride * element.count;
  }
  if (at != bytes_.size()) {
    throw UserError(path.string(),
                    ": has ",
                    bytes_.size() - at,
                    " bytes more than its header says; is it damaged?");
  }
}

const PlyFile::Element* PlyFile::Find(const std::string& element) const {
  for (const Element& known : elements_) {
    if (known.name == element) return &known;
  }
  return nullptr;
}

bool PlyFile::HasElement(const std::string& element) const { return Find(element) != nullptr; }

uint64_t PlyFile::Count(const std::string& element) const {
  const Element* found = Find(element);
  return found == nullptr ? 0 : found->count;
}

std::vector<std::string> PlyFile::Properties(const std::string& element) const {
  std::vector<std::string> names;
  if (const Element* found = Find(element)) {
    for (const Property& property : found->properties) names.push_back(property.name);
  }
  return names;
}

std::vector<double> PlyFile::Values(const std::string& element, const std::string& property) const {
  const Element* found = Find(element);
  const auto known = [&](const Property& p) { return p.name == property; };
  if (found == nullptr || std::none_of(found->properties.begin(), found->properties.end(), known)) {
    throw UserError(path_.string(),
                    ": has no property ",
                    property,
                    " of ",
                    element,
                    ", which should be there; is it of another program?");
  }
  const Property& column = *std::find_if(found->properties.begin(), found->properties.end(), known);
  std::vector<double> values;
  values.reserve(found->count);
  for (uint64_t i = 0; i < found->count; ++i) {
    values.push_back(
        LoadAs(column.type, &bytes_[found->begin + i * found->stride + column.offset]));
  }
  return values;
}

}  // namespace semfoam
