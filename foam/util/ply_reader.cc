// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/ply_reader.h"

#include "foam/util/error.h"
#include "foam/util/number_text.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Larger than any header (ParsePlyHeader) and any number.
constexpr size_t kBufferBytes = size_t{1} << 18;

bool IsBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

}  // namespace

PlyReader::PlyReader(const std::filesystem::path& path, const std::string& wanted)
    : path_(path), file_(path, "a PLY file"), buffer_(kBufferBytes) {
  Fill(kBufferBytes);
  header_ = ParsePlyHeader(path, std::string(buffer_.data(), end_), wanted);
  at_ = header_.data;
  is_text_ = header_.format == "ascii";
  is_big_endian_ = header_.format == "binary_big_endian";
  if (is_text_ || is_big_endian_ || header_.format == "binary_little_endian") return;
  throw UserError(path.string(),
                  ": is a PLY of format ",
                  header_.format.empty() ? "none" : Shortened(header_.format),
                  "; ascii, binary_little_endian and binary_big_endian are what can be read.");
}

void PlyReader::RequireRoomFor(const PlyElement& element) const {
  if (element.properties.empty()) return;
  uint64_t least = 0;
  for (const PlyProperty& property : element.properties) {
    // Of text, a digit and a blank.
    least += is_text_ ? 2 : BytesOf(property.is_list ? property.count_type : property.type);
  }
  // The last blank of the file may be missing.
  const uint64_t room = (BytesLeft() + (is_text_ ? 1 : 0)) / least;
  if (element.count <= room) return;
  throw UserError(path_.string(),
                  ": ends too early: its header says ",
                  element.count,
                  " of ",
                  Shortened(element.name),
                  ", and there is room for at most ",
                  room,
                  "; is the copy complete?");
}

size_t PlyReader::RequireProperty(const PlyElement& element,
                                  std::initializer_list<std::string_view> names,
                                  bool is_list) const {
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (property.is_list != is_list) continue;
    if (std::find(names.begin(), names.end(), property.name) != names.end()) return i;
  }
  throw UserError(path_.string(),
                  ": has no ",
                  is_list ? "list " : "property ",
                  *names.begin(),
                  " of ",
                  Shortened(element.name),
                  ", which should be there; is it of another program?");
}

double PlyReader::NextWord(const PlyProperty& property) {
  do {
    while (at_ < end_ && IsBlank(buffer_[at_])) ++at_;
  } while (at_ == end_ && Fill(1));
  if (at_ == end_) ThrowEnd(record_);
  size_t length = 0;
  while (!(at_ + length < end_ && IsBlank(buffer_[at_ + length]))) {
    if (at_ + length < end_) {
      ++length;
    } else if (length == kBufferBytes || !Fill(length + 1)) {
      break;
    }
  }
  const std::string_view word(buffer_.data() + at_, length);
  at_ += length;
  const char* const from = word.data() + (word.front() == '+' ? 1 : 0);
  const char* const end = word.data() + length;
  double value = 0;
  const auto [stop, error] = std::from_chars(from, end, value);
  if (error == std::errc() && stop == end) return value;
  throw UserError(path_.string(),
                  ": has '",
                  Shortened(word),
                  "' where a number should be, ",
                  Shortened(property.name),
                  " of ",
                  Shortened(element_->name),
                  "; is it damaged?");
}

size_t PlyReader::NextLength(const PlyProperty& property) {
  const double length = Next(property, property.count_type);
  const size_t least = is_text_ ? 1 : BytesOf(property.type);
  const uint64_t most = BytesLeft() / least;
  const bool is_whole = length == std::floor(length) && std::abs(length) < 1e15;
  if (is_whole && length >= 0 && length <= static_cast<double>(most)) {
    return static_cast<size_t>(length);
  }
  throw UserError(path_.string(),
                  ": has a list of ",
                  is_whole ? std::to_string(std::llround(length)) : FormatNumber(length),
                  " ",
                  Shortened(property.name),
                  ", of which at most ",
                  most,
                  " can follow; is it damaged?");
}

void PlyReader::KeepBytes() {
  CHECK_EQ(at_, header_.data);
  keeps_bytes_ = true;
}

void PlyReader::TakeBytes(std::string* bytes) {
  CHECK(keeps_bytes_);
  if (!kept_.empty()) bytes->append(kept_);
  kept_.clear();
  bytes->append(buffer_.data() + kept_from_, at_ - kept_from_);
  kept_from_ = at_;
}

bool PlyReader::SkipBytes() {
  if (at_ == end_) Fill(1);
  const bool has_any = at_ < end_;
  at_ = end_;
  return has_any;
}

bool PlyReader::Fill(size_t least) {
  if (keeps_bytes_) kept_.append(buffer_.data() + kept_from_, at_ - kept_from_);
  kept_from_ = 0;
  std::memmove(buffer_.data(), buffer_.data() + at_, end_ - at_);
  end_ -= at_;
  at_ = 0;
  const size_t got = file_.Read(buffer_.data() + end_, buffer_.size() - end_);
  end_ += got;
  num_read_ += got;
  return end_ >= least;
}

uint64_t PlyReader::BytesLeft() const {
  // A file may have grown since it was opened.
  return std::max(file_.size(), num_read_) - num_read_ + (end_ - at_);
}

void PlyReader::ThrowEnd(uint64_t records) const {
  throw UserError(path_.string(),
                  ": ends too early: its header says ",
                  element_->count,
                  " of ",
                  Shortened(element_->name),
                  ", of which there are ",
                  records,
                  "; is the copy complete?");
}

}  // namespace semfoam
