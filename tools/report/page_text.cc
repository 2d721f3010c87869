// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/page_text.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include <glog/logging.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

namespace semfoam {

std::string Gzip(std::string_view bytes) {
  z_stream stream = {};
  constexpr int kGzip = 16;  // added to the window's bits
  CHECK_EQ(
      deflateInit2(
          &stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzip, 8, Z_DEFAULT_STRATEGY),
      Z_OK);
  std::string compressed;
  char chunk[1 << 16];
  size_t next = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    constexpr size_t kMost = std::numeric_limits<uInt>::max();
    const size_t count = std::min(bytes.size() - next, kMost);
    // zlib reads through this pointer, whose type lacks const.
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + next));
    stream.avail_in = static_cast<uInt>(count);
    const bool is_last = next + count == bytes.size();
    do {
      stream.next_out = reinterpret_cast<Bytef*>(chunk);
      stream.avail_out = sizeof(chunk);
      state = deflate(&stream, is_last ? Z_FINISH : Z_NO_FLUSH);
      CHECK_NE(state, Z_STREAM_ERROR);
      compressed.append(chunk, sizeof(chunk) - stream.avail_out);
    } while (stream.avail_out == 0);
    next += count;
  }
  deflateEnd(&stream);
  return compressed;
}

std::string Base64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (k < count ? static_cast<uint8_t>(bytes[i + k]) : 0);
    }
    for (size_t k = 0; k < 4; ++k) {
      text.push_back(k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=');
    }
  }
  return text;
}

std::string DataUrl(std::string_view type, std::string_view bytes) {
  return "data:" + std::string(type) + ";base64," + Base64(bytes);
}

std::string JsonForHtml(const nlohmann::ordered_json& json) {
  std::string text;
  for (const char c :
       json.dump(-1, ' ', /*ensure_ascii=*/true, nlohmann::json::error_handler_t::replace)) {
    switch (c) {
      case '<':
        text += "\\u003c";
        break;
      case '>':
        text += "\\u003e";
        break;
      case '&':
        text += "\\u0026";
        break;
      default:
        text += c;
    }
  }
  return text;
}

std::string FillPage(std::string_view page, const std::map<std::string, std::string>& parts) {
  std::string filled;
  while (true) {
    const size_t open = page.find("{{");
    filled += page.substr(0, open);
    if (open == std::string_view::npos) return filled;
    const size_t close = page.find("}}", open);
    CHECK(close != std::string_view::npos);
    const auto part = parts.find(std::string(page.substr(open + 2, close - open - 2)));
    CHECK(part != parts.end()) << page.substr(open, close - open);
    filled += part->second;
    page.remove_prefix(close + 2);
  }
}

}  // namespace semfoam
