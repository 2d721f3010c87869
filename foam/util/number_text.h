// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <charconv>
#include <string>
#include <system_error>

namespace semfoam {

// A number as text that reads back as the same number, bit for bit: the shortest there is, "inf",
// "-inf" or "nan".
template <typename T>
std::string FormatNumber(T value) {
  char text[64];
  const auto result = std::to_chars(text, text + sizeof(text), value);
  return std::string(text, result.ptr);
}

// False, and `value` unchanged, where the text is not one number of the type's range and nothing
// else.
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
