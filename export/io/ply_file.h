// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/ply_header.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// A binary little-endian PLY of fixed-size records, as point and splat formats are: its header, and
// its numbers on demand.
class PlyFile {
 public:
  // Reads the header, and holds every count against the bytes that are there. Throws UserError, one
  // sentence naming the file, where it cannot be read, is no PLY, has another encoding, an unknown
  // type, a list, the same name twice, or more or fewer bytes than its header says.
  explicit PlyFile(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }

  bool HasElement(const std::string& element) const;
  // 0 without the element.
  uint64_t Count(const std::string& element) const;
  // In the order of the file; none without the element.
  std::vector<std::string> Properties(const std::string& element) const;

  // The values of one property over all records of the element, whatever its type in the file.
  // Throws UserError where the file has no such property.
  std::vector<double> Values(const std::string& element, const std::string& property) const;

 private:
  struct Element : PlyElement {
    size_t stride = 0;            // bytes of a record
    size_t begin = 0;             // of the first record in `bytes_`
    std::vector<size_t> offsets;  // [properties] in the record
  };
  const Element* Find(const std::string& element) const;

  std::filesystem::path path_;
  std::string bytes_;
  std::vector<Element> elements_;
};

}  // namespace semfoam
