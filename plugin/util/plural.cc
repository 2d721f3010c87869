// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/util/plural.h"

#include <algorithm>
#include <cstddef>

namespace semfoam {

std::string FirstNames(const std::vector<std::string>& names) {
  constexpr size_t kMostNames = 3;
  std::string text;
  const size_t named = std::min(names.size(), kMostNames);
  for (size_t i = 0; i < named; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (named < names.size()) text += " and " + std::to_string(names.size() - named) + " more";
  return text;
}

}  // namespace semfoam
