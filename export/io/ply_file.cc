// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/ply_file.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"

namespace semfoam {

namespace fs = std::filesystem;

PlyFile::PlyFile(const fs::path& path) : path_(path) {
  bytes_ = ReadFileBytes(path, "a PLY file");
  const PlyHeader header = ParsePlyHeader(path, bytes_, "a binary PLY of points");
  if (header.format != "binary_little_endian") {
    throw UserError(path.string(),
                    ": is a PLY of format ",
                    header.format.empty() ? "none" : Shortened(header.format),
                    "; binary_little_endian is what can be read.");
  }
  size_t at = header.data;
  for (const PlyElement& in_header : header.elements) {
    Element& element = elements_.emplace_back(Element{in_header, 0, at, {}});
    for (const PlyProperty& property : element.properties) {
      if (property.is_list) {
        throw UserError(path.string(),
                        ": has lists (",
                        Shortened(property.line),
                        "); a file of points, not of faces, would be right.");
      }
      element.offsets.push_back(element.stride);
      element.stride += BytesOf(property.type);
    }
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
    for (const PlyProperty& property : found->properties) names.push_back(property.name);
  }
  return names;
}

std::vector<double> PlyFile::Values(const std::string& element, const std::string& property) const {
  const Element* found = Find(element);
  const size_t num_properties = found == nullptr ? 0 : found->properties.size();
  size_t column = 0;
  while (column < num_properties && found->properties[column].name != property) ++column;
  if (column == num_properties) {
    throw UserError(path_.string(),
                    ": has no property ",
                    property,
                    " of ",
                    element,
                    ", which should be there; is it of another program?");
  }
  std::vector<double> values;
  values.reserve(found->count);
  for (uint64_t i = 0; i < found->count; ++i) {
    values.push_back(LoadAs(found->properties[column].type,
                            &bytes_[found->begin + i * found->stride + found->offsets[column]]));
  }
  return values;
}

}  // namespace semfoam
