// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/input_file.h"
#include "foam/util/output_file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

// Files that describe themselves and whose bytes are verified when they are read: foam models
// (foam/model/model.h) and checkpoints (foam/train/checkpoint.h).
//
// Little-endian: 8 bytes magic, u32 version, u32 reserved (0), u64 length of the JSON header; the
// header; then blocks of bytes. Each format decides which blocks there are and after which of them
// a checksum stands: an XXH64 of all bytes since the checksum before it, or since the beginning of
// the file. Magic and version stay where they are in every version of a format.

namespace semfoam {

struct ChecksummedFormat {
  // Magic, version, reserved and length of the header.
  static constexpr size_t kPreambleBytes = 24;
  static constexpr size_t kChecksumBytes = 8;

  char magic[8];
  uint32_t version = 0;
  // The header ends and every block begins at a multiple of this number of bytes: the header is
  // padded with spaces, the blocks with zeros.
  size_t alignment = 1;

  // Returns the least multiple of `alignment` that is not below `bytes`.
  size_t Aligned(size_t bytes) const { return (bytes + alignment - 1) / alignment * alignment; }
};

// Returns the text of a header. `path` and `name_owner` are for messages; `name_owner` is the kind
// of object whose names the header holds, with the article ("a label"). Throws UserError where one
// of them is not UTF-8.
std::string HeaderText(const std::filesystem::path& path,
                       const nlohmann::json& header,
                       const std::string& name_owner);

// Returns the value of a header's text; none where ParseJson (foam/util/json_file.h) refuses it.
std::optional<nlohmann::json> ParseHeaderText(std::string_view text);

// Computes the XXH64 of bytes that arrive in parts.
class RunningChecksum;

// Returns the XXH64 of all these bytes, one part after the other, as 16 hexadecimal digits.
std::string ChecksumText(const std::vector<std::span<const std::byte>>& parts);

// Writes such a file from its beginning to its end, beside its target, and moves it into place
// (foam/util/output_file.h). Copies no block.
class ChecksummedWriter {
 public:
  // Writes the preamble and the header. Throws UserError where the file cannot be created.
  ChecksummedWriter(const std::filesystem::path& path,
                    const ChecksummedFormat& format,
                    std::string_view header_text);
  ~ChecksummedWriter();

  // Writes a block and pads it to the format's alignment.
  void Write(std::span<const std::byte> bytes);
  // Writes the XXH64 of all bytes since the last checksum.
  void WriteChecksum();

  // Returns the number of bytes written so far.
  uint64_t size() const { return size_; }

  // Puts the file onto the disk and into its place. Throws UserError where that, or any write
  // before it, is not possible (disk full). Without Commit nothing is left of the file.
  void Commit();

 private:
  // Writes and adds to the checksum.
  void Put(std::span<const std::byte> bytes);

  const std::filesystem::path path_;
  const ChecksummedFormat format_;
  std::unique_ptr<RunningChecksum> checksum_;
  OutputFile file_;
  std::ofstream out_;
  uint64_t size_ = 0;
};

// Reads such a file from its beginning to its end, and compares magic and checksums. The caller
// checks the version and every length before it uses them, and reports what is wrong.
class ChecksummedReader {
 public:
  // Reads the preamble. `what` is the expected kind of file, with its article: "a checkpoint".
  // Throws UserError, here and in Read, where the file cannot be read (InputFile).
  ChecksummedReader(const std::filesystem::path& path,
                    const std::string& what,
                    const ChecksummedFormat& format);
  ~ChecksummedReader();

  // Returns whether magic and version are there and the magic is the format's.
  bool HasMagic() const { return has_magic_; }
  // Return the version and the length of the header in bytes, as stored in the file. Both are
  // meaningless without HasMagic(); the length also where the version is not the format's or the
  // file is shorter than kPreambleBytes.
  uint32_t version() const { return version_; }
  uint64_t header_bytes() const { return header_bytes_; }

  // Returns the number of bytes of the file, and of those that have not been read yet.
  uint64_t size() const { return file_.size(); }
  uint64_t left() const { return size() > position_ ? size() - position_ : 0; }

  // Reads the next `count` bytes. Returns false where there are fewer.
  bool Read(void* bytes, size_t count);
  // Reads the next 8 bytes and returns whether they are the XXH64 of all bytes since the last
  // checksum.
  bool ChecksumMatches();

 private:
  InputFile file_;
  std::unique_ptr<RunningChecksum> checksum_;
  uint64_t position_ = 0;
  bool has_magic_ = false;
  uint32_t version_ = 0;
  uint64_t header_bytes_ = 0;
};

}  // namespace semfoam
