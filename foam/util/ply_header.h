// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Parses the header of a PLY file, for PlyReader, which reads numbers one by one, and PlyFile
// (export/io/ply_file.h), which reads columns of points.

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

size_t BytesOf(PlyType type);
// Returns the value of `type` at `bytes`, in the byte order of this machine.
double LoadAs(PlyType type, const char* bytes);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kUint8;
  bool is_list = false;
  // Type of the count of a list.
  PlyType count_type = PlyType::kUint8;
  // The line in the file.
  std::string line;
};

struct PlyElement {
  std::string name;
  // Number of records; not yet checked against the size of the file.
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  // "ascii", "binary_little_endian", "binary_big_endian", or any other text.
  std::string format;
  std::vector<PlyElement> elements;
  // Offset of the first record.
  size_t data = 0;
};

// Parses the header at the beginning of `bytes`. Throws UserError, one sentence naming the file
// `path`, where the header is incomplete, has an unknown line or type, or the same name twice.
// `wanted` is the expected kind of file, with its article: "a binary PLY of points".
PlyHeader ParsePlyHeader(const std::filesystem::path& path,
                         const std::string& bytes,
                         const std::string& wanted);

}  // namespace semfoam
