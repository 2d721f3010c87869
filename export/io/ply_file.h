// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ply_header.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Reads a binary little-endian PLY of fixed-size records, such as points and splats: its header,
// and its numbers on demand.
class PlyFile {
 public:
  // Reads the header, and checks every count against the size of the file. Throws UserError, one
  // sentence naming the file, where it cannot be read, is no PLY, has another encoding, an unknown
  // type, a list, the same name twice, or more or fewer bytes than its header declares.
  explicit PlyFile(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }

  bool HasElement(const std::string& element) const;
  // Returns the number of records of an element; 0 without the element.
  uint64_t Count(const std::string& element) const;
  // Returns the names of an element's properties in the order of the file; none without the
  // element.
  std::vector<std::string> Properties(const std::string& element) const;

  // Returns the values of one property over all records of the element, converted from its type in
  // the file. Throws UserError where the file has no such property.
  std::vector<double> Values(const std::string& element, const std::string& property) const;

 private:
  struct Element : PlyElement {
    // Length of a record in bytes.
    size_t stride = 0;
    // Offset of the first record in `bytes_`.
    size_t begin = 0;
    // [properties] Offsets in the record.
    std::vector<size_t> offsets;
  };
  const Element* Find(const std::string& element) const;

  std::filesystem::path path_;
  std::string bytes_;
  std::vector<Element> elements_;
};

}  // namespace semfoam
