// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

constexpr size_t kMaxNameLength = 100;

bool IsLetterOrDigit(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
}

bool IsUtf8Continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

uint8_t HslChannel(double hue, double saturation, int offset) {
  // HSL to RGB at lightness 0.5: the channel runs between 0.5 (1 - s) and 0.5 (1 + s).
  const double k = std::fmod(offset + 12 * hue, 12.0);
  const double swing = 0.5 * saturation;
  const double value = 0.5 - swing * std::max(-1.0, std::min({k - 3, 9 - k, 1.0}));
  return static_cast<uint8_t>(std::lround(255 * value));
}

}  // namespace

std::string DisplayName(LabelId id, const std::string& name) {
  return name.empty() ? "label_" + std::to_string(Value(id)) : name;
}

std::string SanitizedName(LabelId id, const std::string& name) {
  std::string clean;
  for (const char c : name) {
    if (IsUtf8Continuation(c)) continue;
    clean += IsLetterOrDigit(c) || c == '-' ? c : '_';
    if (clean.size() == kMaxNameLength) break;
  }
  if (std::none_of(clean.begin(), clean.end(), IsLetterOrDigit)) return DisplayName(id, "");
  return clean;
}

std::string FileStem(LabelId id, const std::string& name) {
  return std::to_string(Value(id)) + "_" + SanitizedName(id, name);
}

std::string OneLine(const std::string& name) {
  using nlohmann::json;
  const std::string quoted = json(name).dump(-1, ' ', false, json::error_handler_t::replace);
  std::string text = json::parse(quoted).get<std::string>();
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text;
}

std::array<uint8_t, 3> LabelColor(LabelId id) {
  if (id == kNoObject) return {0, 0, 0};
  const double turns = Value(id) * 1.6180339887;
  const double hue = turns - std::floor(turns);
  const double saturation = Value(id) % 2 == 0 ? 0.5 : 1.0;
  return {HslChannel(hue, saturation, 0),
          HslChannel(hue, saturation, 8),
          HslChannel(hue, saturation, 4)};
}

}  // namespace semfoam
