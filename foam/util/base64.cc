// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/base64.h"

#include <cstdint>

namespace semfoam {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::optional<std::string> DecodeBase64(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  uint32_t group = 0;
  int digits = 0;
  bool has_ended = false;
  for (const char c : text) {
    if (c == '\n' || c == '\r') continue;
    if (c == '=') {
      has_ended = true;
      continue;
    }
    const size_t digit = kDigits.find(c);
    if (has_ended || digit == std::string_view::npos) return std::nullopt;
    group = group << 6 | static_cast<uint32_t>(digit);
    if (++digits < 4) continue;
    for (int shift = 16; shift >= 0; shift -= 8) bytes += static_cast<char>(group >> shift & 0xff);
    group = 0;
    digits = 0;
  }
  if (digits == 1) return std::nullopt;
  if (digits > 1) {
    group <<= 6 * (4 - digits);
    for (int shift = 16; shift > 24 - 8 * digits; shift -= 8) {
      bytes += static_cast<char>(group >> shift & 0xff);
    }
  }
  return bytes;
}

}  // namespace semfoam
