// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace semfoam {

// Throws UserError, one sentence, unless `path` is a regular file (or a link to one) that may be
// read: a folder, a pipe that would block for ever and a device that never ends are no input.
// `what` says what it should be, with its article: "a COLMAP model's file".
void RequireRegularFile(const std::filesystem::path& path, const std::string& what);

// A regular file, read from its beginning on.
class InputFile {
 public:
  // Throws UserError as RequireRegularFile does.
  InputFile(std::filesystem::path path, std::string what);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  // When it was opened; 0 for files that have none, such as those of /proc.
  uint64_t size() const { return size_; }

  // Reads the next `count` bytes and returns how many there were: fewer at the end of the file
  // alone. Throws UserError where reading fails, which says nothing about what the file holds.
  size_t Read(void* bytes, size_t count);

 private:
  const std::filesystem::path path_;
  const std::string what_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
};

// All bytes of a regular file, and as much memory as it has bytes. Throws UserError, one sentence
// that names the file, as RequireRegularFile does, and where it may not or cannot be read to its
// end.
std::string ReadFileBytes(const std::filesystem::path& path, const std::string& what);

// Without the three bytes that some editors put before UTF-8.
std::string_view WithoutByteOrderMark(std::string_view text);

// `text` as a sentence can quote it: on one line, without control characters, and cut after some 60
// bytes.
std::string Shortened(std::string_view text);

}  // namespace semfoam
