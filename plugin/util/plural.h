// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Returns "1 photo" or "2 photos".
inline std::string Plural(int64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

// Returns the first names of a list: "a, b, c and 7 more".
std::string FirstNames(const std::vector<std::string>& names);

}  // namespace semfoam
