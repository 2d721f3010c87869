// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {

class ChecksummedReader;

// The file of a checkpoint: a state that a run can go on from. The caller decides what is in it;
// this writes and reads it, whole or not at all.
//
// A checksummed file (foam/util/checksummed_file.h), little-endian: 8 bytes magic "SEMFCKP\n", u32
// version, u32 reserved (0), u64 length of the JSON header; the header, {"arrays": [{"name",
// "bytes"}, ...], "texts": {group: {name: text}}}; an XXH64 of all that; then the bytes of each
// array, each followed by their XXH64; at the end 8 bytes "SEMFEND\n" and the u64 length of the
// whole file.
inline constexpr uint32_t kCheckpointVersion = 1;

// Texts by name, in groups. Numbers are texts too (foam/util/number_text.h), so that NaN and
// infinity are numbers like others.
using CheckpointTexts = std::map<std::string, std::map<std::string, std::string>>;

// What is to be written. The arrays lie elsewhere, and must until then; no two have one name.
struct CheckpointContents {
  struct Array {
    std::string name;
    std::span<const std::byte> bytes;
  };
  CheckpointTexts texts;  // UTF-8
  std::vector<Array> arrays;
};

// Written beside, put on the disk, and moved into place (foam/util/output_file.h). Copies no array.
// Throws UserError where that is not possible (disk full).
void WriteCheckpoint(const std::filesystem::path& path, const CheckpointContents& contents);

// The file does not hold a whole checkpoint: it is cut, damaged, or something else.
class DamagedCheckpoint : public UserError {
 public:
  using UserError::UserError;
};

// A checkpoint in memory.
class Checkpoint {
 public:
  // Reads and verifies the whole file. Throws, with one sentence that names it: DamagedCheckpoint;
  // or UserError where the file says nothing about what it holds, because it is missing, cannot be
  // read (permission, a failing disk), or is of another version of the format, older or newer,
  // which is judged by the version number alone. Every length in the file is checked against the
  // bytes that are there before it is used.
  explicit Checkpoint(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }

  // Of a group; empty where there is none of that name.
  const std::map<std::string, std::string>& Texts(const std::string& group) const;

  bool HasArray(const std::string& name) const { return arrays_.count(name) != 0; }
  // Throws DamagedCheckpoint where there is none of that name.
  std::span<const std::byte> Array(const std::string& name) const;

  // A DamagedCheckpoint that names the file, for what is wrong with the texts or arrays themselves.
  [[noreturn]] void ThrowDamaged(const std::string& what) const;

 private:
  struct Bytes {
    std::unique_ptr<std::byte[]> data;
    size_t size = 0;
  };
  // Names of the arrays and their lengths in bytes, in the file's order.
  using ArrayTable = std::vector<std::pair<std::string, uint64_t>>;

  // Reads the header into texts_, and returns the arrays that come behind it. Checks their lengths
  // against the file's.
  ArrayTable ReadHeader(ChecksummedReader* file);
  void ReadArray(const std::string& name, uint64_t count, ChecksummedReader* file);
  [[noreturn]] void ThrowNoCheckpoint() const;

  std::filesystem::path path_;
  CheckpointTexts texts_;
  std::map<std::string, Bytes> arrays_;
};

}  // namespace semfoam
