// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/input_file.h"
#include "foam/util/ply_header.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace semfoam {

// Reads the numbers of a PLY one by one, in text or in binary of either byte order, with lists. Its
// memory does not depend on the size of the file, nor on the counts in its header.
class PlyReader {
 public:
  // Reads the header. `wanted` as for ParsePlyHeader. Throws UserError, one sentence naming the
  // file, where it cannot be read, as ParsePlyHeader does, or where it has another encoding.
  PlyReader(const std::filesystem::path& path, const std::string& wanted);

  const std::filesystem::path& path() const { return path_; }
  const PlyHeader& header() const { return header_; }

  // Calls `take(record, column, value)` for each number of the element in the order of the file,
  // where `record` counts from 0 and `column` is the index in PlyElement::properties; for a list as
  // often as it has entries. Must be called once for each element of the header, in its order.
  // Throws UserError where the file ends too early, has a text that is no number, or a list longer
  // than the rest of the file.
  template <typename Take>
  void ReadRecords(const PlyElement& element, const Take& take) {
    ReadRecords(element, take, [](uint64_t, size_t) {});
  }

  // Does the same, and calls `after(record, column)` behind the last number of each property, also
  // of an empty list.
  template <typename Take, typename After>
  void ReadRecords(const PlyElement& element, const Take& take, const After& after) {
    if (element.properties.empty()) return;  // however many
    element_ = &element;
    for (record_ = 0; record_ < element.count; ++record_) {
      for (size_t column = 0; column < element.properties.size(); ++column) {
        const PlyProperty& property = element.properties[column];
        const size_t length = property.is_list ? NextLength(property) : 1;
        for (size_t k = 0; k < length; ++k) take(record_, column, Next(property, property.type));
        after(record_, column);
      }
    }
  }

  // Keeps the bytes of what is read, from the beginning of the file on, until they are taken. Must
  // be called before the first record is read.
  void KeepBytes();
  // Appends to `bytes` the kept bytes, as they are in the file: the header first, then those of
  // each number behind the one before. In text, the blanks and the line's end before a number are
  // its own.
  void TakeBytes(std::string* bytes);
  // Moves behind the next bytes that are left of the file, after the last record; returns false
  // where there are none.
  bool SkipBytes();

  // Throws UserError where the rest of the file is too short for the records of the next element,
  // each of its least length. Reads nothing.
  void RequireRoomFor(const PlyElement& element) const;

  // Returns the index of the element's property, or list, of one of these names; of several the
  // first in the file. Throws UserError where it has none.
  size_t RequireProperty(const PlyElement& element,
                         std::initializer_list<std::string_view> names,
                         bool is_list = false) const;

 private:
  double Next(const PlyProperty& property, PlyType type) {
    if (is_text_) return NextWord(property);
    const size_t size = BytesOf(type);
    if (size > end_ - at_ && !Fill(size)) ThrowEnd(record_);
    const char* bytes = buffer_.data() + at_;
    at_ += size;
    if (!is_big_endian_) return LoadAs(type, bytes);
    char reversed[8];
    std::reverse_copy(bytes, bytes + size, reversed);
    return LoadAs(type, reversed);
  }
  double NextWord(const PlyProperty& property);
  // Returns the length of a list, for which there are bytes.
  size_t NextLength(const PlyProperty& property);

  // Reads on until the buffer holds `least` bytes from `at_` on. Returns false where the file ends
  // before.
  bool Fill(size_t least);
  uint64_t BytesLeft() const;
  [[noreturn]] void ThrowEnd(uint64_t records) const;

  std::filesystem::path path_;
  InputFile file_;
  // The bytes read and not yet taken: [at_, end_).
  std::vector<char> buffer_;
  size_t at_ = 0;
  size_t end_ = 0;
  // Number of bytes read so far.
  uint64_t num_read_ = 0;
  // The bytes of KeepBytes: `kept_`, then [kept_from_, at_) of the buffer.
  bool keeps_bytes_ = false;
  std::string kept_;
  size_t kept_from_ = 0;
  PlyHeader header_;
  bool is_text_ = false;
  bool is_big_endian_ = false;
  // For sentences: which of how many of what is read.
  const PlyElement* element_ = nullptr;
  uint64_t record_ = 0;
};

}  // namespace semfoam
