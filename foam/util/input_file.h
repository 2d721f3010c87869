// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace semfoam {

// Throws UserError, one sentence, unless `path` is a regular file (or a link to one) that may be
// read. Refuses folders, pipes, which could block forever, and devices, which may have no end.
// `what` is the expected kind of file, with its article: "a COLMAP model's file".
void RequireRegularFile(const std::filesystem::path& path, const std::string& what);

// Reads a regular file from its beginning to its end.
class InputFile {
 public:
  // Throws UserError as RequireRegularFile does.
  InputFile(std::filesystem::path path, std::string what);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  // Returns the size in bytes at the time of opening; 0 for files that report none, such as those
  // of /proc.
  uint64_t size() const { return size_; }

  // Reads the next `count` bytes and returns how many were read: fewer only at the end of the file.
  // Throws UserError where reading fails.
  size_t Read(void* bytes, size_t count);

 private:
  const std::filesystem::path path_;
  const std::string what_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
};

// Returns all bytes of a regular file. Takes as much memory as the file has bytes. Throws
// UserError, one sentence that names the file, as RequireRegularFile does and where the file cannot
// be read to its end.
std::string ReadFileBytes(const std::filesystem::path& path, const std::string& what);

// Returns `text` without the three bytes of the UTF-8 byte order mark that some editors write at
// the beginning.
std::string_view WithoutByteOrderMark(std::string_view text);

// Returns `text` in a form to be quoted in a message: on one line, with control characters escaped,
// and cut after about 60 bytes.
std::string Shortened(std::string_view text);

}  // namespace semfoam
