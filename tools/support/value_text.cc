// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/value_text.h"

#include "foam/util/number_text.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <type_traits>
#include <utility>

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

// Returns the text with a suffix written as an exponent: "1.5k" is "1.5e3".
std::string WithExponent(const std::string& text) {
  constexpr std::pair<char, const char*> kSuffixes[] = {
      {'k', "e3"}, {'K', "e3"}, {'M', "e6"}, {'G', "e9"}};
  for (const auto& [suffix, exponent] : kSuffixes) {
    // "1e3k" says it twice, and stays a text that is no number.
    if (text.empty() || text.back() != suffix || text.find_first_of("eE") != std::string::npos) {
      continue;
    }
    return text.substr(0, text.size() - 1) + exponent;
  }
  return text;
}

// Returns the digits of a whole number that is written with a point or an exponent, without
// rounding: "1.5e3" is "1500". Returns "" for other texts.
std::string WholeDigits(const std::string& text) {
  const size_t mark = std::min(text.find_first_of("eE"), text.size());
  int exponent = 0;
  if (mark < text.size()) {
    std::string written = text.substr(mark + 1);
    if (written.starts_with('+')) written.erase(0, 1);
    // No integer has more digits.
    if (!ParseNumber(written, &exponent) || std::abs(exponent) > 100) return "";
  }
  std::string digits = text.substr(0, mark);
  const bool is_negative = digits.starts_with('-');
  if (is_negative) digits.erase(0, 1);
  if (const size_t point = digits.find('.'); point != std::string::npos) {
    exponent -= static_cast<int>(digits.size() - point - 1);
    digits.erase(point, 1);
  }
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos) return "";
  for (; exponent > 0; --exponent) digits += '0';
  for (; exponent < 0; ++exponent) {
    if (digits.back() != '0') return "";
    digits.pop_back();
    if (digits.empty()) digits += '0';
  }
  if (is_negative) digits.insert(digits.begin(), '-');
  return digits;
}

template <typename T>
bool ParseWrittenNumber(const std::string& text, T* value) {
  if (ParseFinite(text, value)) return true;
  const std::string written = WithExponent(text);
  if constexpr (std::is_integral_v<T>) return ParseFinite(WholeDigits(written), value);
  return ParseFinite(written, value);
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

bool ParseWrittenValue(const std::string& text, std::string* value) {
  return ParseValue(text, value);
}
bool ParseWrittenValue(const std::string& text, bool* value) { return ParseValue(text, value); }
bool ParseWrittenValue(const std::string& text, int* value) {
  return ParseWrittenNumber(text, value);
}
bool ParseWrittenValue(const std::string& text, int64_t* value) {
  return ParseWrittenNumber(text, value);
}
bool ParseWrittenValue(const std::string& text, uint64_t* value) {
  return ParseWrittenNumber(text, value);
}
bool ParseWrittenValue(const std::string& text, float* value) {
  return ParseWrittenNumber(text, value);
}
bool ParseWrittenValue(const std::string& text, double* value) {
  return ParseWrittenNumber(text, value);
}

std::string FormatValue(const std::string& value) { return value; }
std::string FormatValue(bool value) { return value ? "1" : "0"; }
std::string FormatValue(int value) { return FormatNumber(value); }
std::string FormatValue(int64_t value) { return FormatNumber(value); }
std::string FormatValue(uint64_t value) { return FormatNumber(value); }
std::string FormatValue(float value) { return FormatNumber(value); }
std::string FormatValue(double value) { return FormatNumber(value); }

}  // namespace semfoam
