// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <type_traits>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

// A file of arrays that one process writes and reads again, one after the other: of each its u64
// number of elements, then these as they lie in memory.
class PieceWriter {
 public:
  explicit PieceWriter(const std::filesystem::path& path)
      : path_(path), out_(path, std::ios::binary) {}

  template <typename T>
  void Write(const std::vector<T>& values) {
    const uint64_t count = values.size();
    out_.write(reinterpret_cast<const char*>(&count), sizeof(count));
    out_.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(count * sizeof(T)));
  }

  // Throws UserError where the file could not be written.
  void Close() {
    out_.close();
    if (out_.fail()) {
      throw UserError(path_.string(), ": cannot be written completely; is the disk full?");
    }
  }

 private:
  const std::filesystem::path path_;
  std::ofstream out_;
};

class PieceReader {
 public:
  // Throws UserError, here and in Read, where the file cannot be read.
  explicit PieceReader(const std::filesystem::path& path)
      : path_(path), file_(path, "a piece of an export") {}

  // Reads the next array, which must have been written as one of T.
  template <typename T>
  std::vector<T> Read() {
    uint64_t count = 0;
    ReadBytes(&count, sizeof(count));
    if (count > file_.size() / sizeof(T)) FailCut();
    std::vector<T> values(count);
    ReadBytes(values.data(), count * sizeof(T));
    return values;
  }

 private:
  void ReadBytes(void* bytes, size_t count) {
    if (file_.Read(bytes, count) != count) FailCut();
  }
  [[noreturn]] void FailCut() const {
    throw UserError(path_.string(),
                    ": is shorter than it was written; was it changed during the export?");
  }

  const std::filesystem::path path_;
  InputFile file_;
};

}  // namespace semfoam
