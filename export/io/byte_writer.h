// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <type_traits>

namespace semfoam {

static_assert(std::endian::native == std::endian::little);

// Appends the bytes of `value`, little-endian.
template <typename T>
void AppendBinary(const T& value, std::string* bytes) {
  static_assert(std::is_arithmetic_v<T>);
  const size_t at = bytes->size();
  bytes->resize(at + sizeof(T));
  std::memcpy(&(*bytes)[at], &value, sizeof(T));
}

// Writes one output file by means of OutputFile, in large blocks. Without Finish the file is
// removed.
class ByteWriter {
 public:
  explicit ByteWriter(const std::filesystem::path& target)
      : target_(target), file_(target), out_(file_.temporary_path(), std::ios::binary) {}

  void Text(std::string_view text) {
    if (text.size() >= kPiece) {
      Flush();
      out_.write(text.data(), static_cast<std::streamsize>(text.size()));
      return;
    }
    bytes_.append(text);
    if (bytes_.size() >= kPiece) Flush();
  }

  template <typename T>
  void Binary(const T& value) {
    AppendBinary(value, &bytes_);
    if (bytes_.size() >= kPiece) Flush();
  }

  // Appends the shortest digits that parse to the same number of the same type.
  template <typename T>
  void Number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
    Text({digits, end});
  }

  // Writes the rest and puts the file into place. Throws UserError when not all bytes could be
  // written.
  void Finish() {
    Flush();
    out_.close();
    if (out_.fail()) {
      throw UserError(target_.string(), ": cannot be written completely; is the disk full?");
    }
    file_.Commit();
  }

 private:
  static constexpr size_t kPiece = 1 << 20;

  void Flush() {
    out_.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
    bytes_.clear();
  }

  std::filesystem::path target_;
  OutputFile file_;
  std::ofstream out_;
  std::string bytes_;
};

}  // namespace semfoam
