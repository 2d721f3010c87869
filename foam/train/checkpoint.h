// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {

class ChecksummedReader;

// Writes and reads checkpoints: files with a state from which a run can resume. The caller decides
// the contents; a file is read as a whole or refused.
//
// A checksummed file (foam/util/checksummed_file.h), little-endian: 8 bytes magic "SEMFCKP\n", u32
// version, u32 reserved (0), u64 length of the JSON header; the header, {"arrays": [{"name",
// "bytes"}, ...], "texts": {group: {name: text}}}; an XXH64 of all that; then the bytes of each
// array, each followed by their XXH64; at the end 8 bytes "SEMFEND\n" and the u64 length of the
// whole file.
inline constexpr uint32_t kCheckpointVersion = 8;

// Texts by name, in groups. Numbers are stored as texts too (foam/util/number_text.h), because JSON
// has no NaN and infinity.
using CheckpointTexts = std::map<std::string, std::map<std::string, std::string>>;

// The contents to write. The arrays are borrowed and must exist until the file is written; their
// names are unique.
struct CheckpointContents {
  struct Array {
    std::string name;
    std::span<const std::byte> bytes;
  };
  // In UTF-8.
  CheckpointTexts texts;
  std::vector<Array> arrays;
};

// Writes a checkpoint beside its target and moves it into place (foam/util/output_file.h). Copies
// no array. Throws UserError where it cannot be written (disk full).
void WriteCheckpoint(const std::filesystem::path& path, const CheckpointContents& contents);

// Reports a file that does not hold a complete checkpoint: it is cut, damaged, or of another kind.
class DamagedCheckpoint : public UserError {
 public:
  using UserError::UserError;
};

// What would be right where a file that a split has written is damaged.
inline constexpr char kRemedyOfSplit[] = "a new split of the run";

// A checkpoint in memory.
class Checkpoint {
 public:
  // Reads and verifies the whole file. Throws DamagedCheckpoint where it is damaged. Throws
  // UserError where its contents are unknown: the file is missing, cannot be read (permission, a
  // failing disk), or has another version of the format, older or newer, judged by the version
  // number alone. Both name the file in one sentence. Every length in the file is checked against
  // the file's size before it is used. Arrays whose names `keeps` does not want are verified, too,
  // and then not there; empty: all are. `remedy` is what would be right where the file is damaged,
  // in its error.
  explicit Checkpoint(const std::filesystem::path& path,
                      const std::function<bool(const std::string& name)>& keeps = {},
                      std::string remedy = "an older one, or training from the beginning,");

  const std::filesystem::path& path() const { return path_; }

  // Returns the texts of a group; empty if the checkpoint has none of that name.
  const std::map<std::string, std::string>& Texts(const std::string& group) const;

  bool HasArray(const std::string& name) const { return arrays_.count(name) != 0; }
  // Returns the bytes of an array. Throws DamagedCheckpoint where there is none of that name.
  std::span<const std::byte> Array(const std::string& name) const;

  // Returns all texts and arrays, the latter borrowed and in the order of their names.
  CheckpointContents Contents() const;

  // Throws a DamagedCheckpoint that names the file, for errors in the texts or arrays.
  [[noreturn]] void ThrowDamaged(const std::string& what) const;

 private:
  struct Bytes {
    std::unique_ptr<std::byte[]> data;
    size_t size = 0;
  };
  // Names of the arrays and their lengths in bytes, in the file's order.
  using ArrayTable = std::vector<std::pair<std::string, uint64_t>>;

  // Reads the header into texts_, and returns the table of arrays that follow it. Checks their
  // lengths against the file's.
  ArrayTable ReadHeader(ChecksummedReader* file);
  void ReadArray(const std::string& name, uint64_t count, bool keeps, ChecksummedReader* file);
  [[noreturn]] void ThrowNoCheckpoint() const;

  std::filesystem::path path_;
  std::string remedy_;
  CheckpointTexts texts_;
  std::map<std::string, Bytes> arrays_;
};

}  // namespace semfoam
