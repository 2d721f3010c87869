// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <charconv>
#include <string>
#include <system_error>

namespace semfoam {

// Returns the shortest text that parses to the same number, bit for bit; also "inf", "-inf" and
// "nan".
template <typename T>
std::string FormatNumber(T value) {
  char text[64];
  const auto result = std::to_chars(text, text + sizeof(text), value);
  return std::string(text, result.ptr);
}

// Parses a text that is one number in the type's range and nothing else. Returns false, and leaves
// `value` unchanged, where it is not.
template <typename T>
bool ParseNumber(const std::string& text, T* value) {
  T parsed{};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, parsed);
  if (result.ec != std::errc() || result.ptr != end) return false;
  *value = parsed;
  return true;
}

}  // namespace semfoam
