// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/run_lengths.h"

#include <algorithm>
#include <limits>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kBitsOfGroup = 5;
// Enough for any length of a picture, and no shift can overflow.
constexpr int kMostGroups = 9;
constexpr int64_t kLongestRun = int64_t{1} << 40;

// Pixels (x, y) with begin <= y < end of one column.
struct ColumnSpan {
  int x = 0;
  int begin = 0;
  int end = 0;
};

// Cuts runs over the columns where a column ends.
std::vector<ColumnSpan> SpansOf(const std::vector<int64_t>& lengths, int height) {
  std::vector<ColumnSpan> spans;
  int64_t at = 0;
  for (size_t i = 0; i < lengths.size(); ++i) {
    const int64_t end = at + lengths[i];
    if (i % 2 == 0) at = end;
    while (at < end) {
      const int64_t x = at / height;
      const int64_t end_of_column = std::min(end, (x + 1) * height);
      spans.push_back({static_cast<int>(x),
                       static_cast<int>(at - x * height),
                       static_cast<int>(end_of_column - x * height)});
      at = end_of_column;
    }
  }
  return spans;
}

}  // namespace

RunLengths DecodeRunLengths(std::string_view text) {
  RunLengths result;
  const auto fail = [&](std::string error) {
    result.lengths.clear();
    result.error = std::move(error);
    return result;
  };
  for (size_t at = 0; at < text.size();) {
    const std::string which = "run " + std::to_string(result.lengths.size() + 1);
    int64_t value = 0;
    for (int group = 0;; ++group) {
      if (at == text.size()) return fail(which + " is cut");
      if (group == kMostGroups) return fail(which + " has more than 9 characters");
      const int code = static_cast<unsigned char>(text[at++]) - '0';
      if (code < 0 || code > 63) {
        return fail("character " + std::to_string(at) + " is none of a compressed run");
      }
      value |= static_cast<int64_t>(code & 31) << (kBitsOfGroup * group);
      if ((code & 32) != 0) continue;
      if ((code & 16) != 0) value |= -(int64_t{1} << (kBitsOfGroup * (group + 1)));
      break;
    }
    if (result.lengths.size() > 2) value += result.lengths[result.lengths.size() - 2];
    if (value < 0) return fail(which + " is negative");
    if (value > kLongestRun) return fail(which + " is longer than any picture");
    result.lengths.push_back(value);
  }
  return result;
}

std::string EncodeRunLengths(const std::vector<int64_t>& lengths) {
  std::string text;
  for (size_t i = 0; i < lengths.size(); ++i) {
    int64_t value = lengths[i] - (i > 2 ? lengths[i - 2] : 0);
    for (;;) {
      int code = static_cast<int>(value & 31);
      value >>= kBitsOfGroup;
      const bool ends = (code & 16) != 0 ? value == -1 : value == 0;
      if (!ends) code |= 32;
      text += static_cast<char>(code + '0');
      if (ends) break;
    }
  }
  return text;
}

std::optional<PixelRuns> RunsOfLengths(const std::vector<int64_t>& lengths, const PhotoSize& size) {
  const int64_t num_pixels = static_cast<int64_t>(size.width) * size.height;
  int64_t left = num_pixels;
  for (const int64_t length : lengths) {
    if (length < 0 || length > left) return std::nullopt;
    left -= length;
  }
  if (left != 0) return std::nullopt;
  const std::vector<ColumnSpan> spans = SpansOf(lengths, size.height);
  PixelRuns runs;
  if (spans.empty()) return runs;
  // A bitmap of the rectangle around the region turns columns into rows.
  const int left_x = spans.front().x;
  const int width = spans.back().x - left_x + 1;
  int top = size.height, bottom = 0;
  for (const ColumnSpan& span : spans) {
    top = std::min(top, span.begin);
    bottom = std::max(bottom, span.end);
  }
  std::vector<uint8_t> bitmap(static_cast<size_t>(width) * (bottom - top));
  for (const ColumnSpan& span : spans) {
    for (int y = span.begin; y < span.end; ++y) {
      bitmap[static_cast<size_t>(y - top) * width + (span.x - left_x)] = 1;
    }
  }
  for (int y = top; y < bottom; ++y) {
    const uint8_t* row = bitmap.data() + static_cast<size_t>(y - top) * width;
    const int64_t first = static_cast<int64_t>(y) * size.width + left_x;
    for (int x = 0; x < width;) {
      const int begin = x;
      while (x < width && row[x] == row[begin]) ++x;
      if (row[begin] != 0) AppendRun({first + begin, first + x}, &runs);
    }
  }
  return runs;
}

std::vector<int64_t> LengthsOfRuns(const PixelRuns& runs, const PhotoSize& size) {
  std::vector<int64_t> lengths;
  int64_t at = 0;  // where the last length ends
  if (!runs.empty()) {
    const auto top = static_cast<int>(runs.front().begin / size.width);
    const auto bottom = static_cast<int>((runs.back().end - 1) / size.width) + 1;
    const int64_t first = static_cast<int64_t>(top) * size.width;
    std::vector<uint8_t> bitmap(static_cast<size_t>(bottom - top) * size.width);
    for (const PixelRun& run : runs) {
      std::fill(bitmap.begin() + (run.begin - first), bitmap.begin() + (run.end - first), 1);
    }
    for (int x = 0; x < size.width; ++x) {
      for (int y = top; y < bottom; ++y) {
        if (bitmap[static_cast<size_t>(y - top) * size.width + x] == 0) continue;
        const int64_t pixel = static_cast<int64_t>(x) * size.height + y;
        if (lengths.empty() || pixel > at) {
          lengths.push_back(pixel - at);
          lengths.push_back(0);
        }
        ++lengths.back();
        at = pixel + 1;
      }
    }
  }
  const int64_t num_pixels = static_cast<int64_t>(size.width) * size.height;
  if (at < num_pixels) lengths.push_back(num_pixels - at);
  return lengths;
}

}  // namespace semfoam
