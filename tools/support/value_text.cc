// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/value_text.h"

#include "foam/util/number_text.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace semfoam {
namespace {

// Numbers of the user's are finite.
template <typename T>
bool ParseFinite(const std::string& text, T* value) {
  T parsed{};
  if (!ParseNumber(text, &parsed)) return false;
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(parsed)) return false;
  }
  *value = parsed;
  return true;
}

}  // namespace

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::string Joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

std::string ShellQuoted(const std::string& text) {
  const bool is_plain = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string("_-+=./:,@%").find(c) != std::string::npos;
  });
  if (is_plain) return text;
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') {
      quoted += "'\\''";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

bool ParseValue(const std::string& text, std::string* value) {
  *value = text;
  return true;
}

bool ParseValue(const std::string& text, bool* value) {
  if (text != "0" && text != "1" && text != "true" && text != "false") return false;
  *value = text == "1" || text == "true";
  return true;
}

bool ParseValue(const std::string& text, int* value) { return ParseFinite(text, value); }
bool ParseValue(const std::string& text, int64_t* value) { return ParseFinite(text, value); }
bool ParseValue(const std::string& text, uint64_t* value) { return ParseFinite(text, value); }
bool ParseValue(const std::string& text, float* value) { return ParseFinite(text, value); }
bool ParseValue(const std::string& text, double* value) { return ParseFinite(text, value); }

std::string FormatValue(const std::string& value) { return value; }
std::string FormatValue(bool value) { return value ? "1" : "0"; }
std::string FormatValue(int value) { return FormatNumber(value); }
std::string FormatValue(int64_t value) { return FormatNumber(value); }
std::string FormatValue(uint64_t value) { return FormatNumber(value); }
std::string FormatValue(float value) { return FormatNumber(value); }
std::string FormatValue(double value) { return FormatNumber(value); }

}  // namespace semfoam
