// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// What the header of a PLY file says of the bytes after it. PlyFile reads those of points,
// ReadPlyMesh (tools/evaluation/ply_mesh.h) those of meshes.

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

size_t BytesOf(PlyType type);
// The value whose bytes, in the order of this machine, begin at `bytes`.
double LoadAs(PlyType type, const char* bytes);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kUint8;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  // of a list
  std::string line;                      // as the file has it
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;  // not to be believed before there are bytes for so many
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::string format;  // "ascii", "binary_little_endian", "binary_big_endian", or anything
  std::vector<PlyElement> elements;
  size_t data = 0;  // where the first record begins
};

// Throws UserError, one sentence naming the file `path` with these bytes, where they do not begin
// with a whole header, or it has an unknown line or type, or the same name twice. `wanted` says
// what would be right, with its article: "a binary PLY of points".
PlyHeader ParsePlyHeader(const std::filesystem::path& path,
                         const std::string& bytes,
                         const std::string& wanted);

}  // namespace semfoam
