// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semfoam {

// Names of the values of an enum in options, files and messages: one array of EnumName beside the
// enum, in the order in which options list the values.
//
//   enum class UpAxis { kColmap, kY, kZ };
//   inline constexpr EnumName<UpAxis> kUpAxisNames[] = {{UpAxis::kColmap, "colmap"}, ...};
template <typename Enum>
struct EnumName {
  Enum value;
  const char* name;
};

// Returns the name of a value, which must be in the array (aborts).
template <typename Enum, size_t kCount>
std::string NameOf(const EnumName<Enum> (&names)[kCount], Enum value) {
  for (const EnumName<Enum>& known : names) {
    if (known.value == value) return known.name;
  }
  std::abort();
}

// Returns the value of this name; nothing where the array does not have it.
template <typename Enum, size_t kCount>
std::optional<Enum> ParseEnum(const EnumName<Enum> (&names)[kCount], std::string_view name) {
  for (const EnumName<Enum>& known : names) {
    if (name == known.name) return known.value;
  }
  return std::nullopt;
}

// Returns all names in the order of the array.
template <typename Enum, size_t kCount>
std::vector<std::string> AllNames(const EnumName<Enum> (&names)[kCount]) {
  std::vector<std::string> all;
  for (const EnumName<Enum>& known : names) all.push_back(known.name);
  return all;
}

}  // namespace semfoam
