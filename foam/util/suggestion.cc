// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/suggestion.h"

#include <algorithm>
#include <cctype>
#include <cstddef>

namespace semfoam {
namespace {

// No name is longer; a longer text is not compared.
constexpr size_t kLongestName = 64;

std::string Normalized(std::string name) {
  for (char& c : name) {
    c = c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return name;
}

// Returns the optimal string alignment distance: insertions, deletions, replacements, and swaps of
// neighbours, none of them within another.
size_t Distance(const std::string& a, const std::string& b) {
  // Rows i - 2, i - 1 and i of the table of distances between prefixes.
  std::vector<size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    before.swap(last);
    last.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] =
          std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

}  // namespace

std::string NearestName(const std::string& misspelt, const std::vector<std::string>& names) {
  if (misspelt.empty() || misspelt.size() > kLongestName) return "";
  const std::string text = Normalized(misspelt);
  const size_t most = text.size() <= 4 ? 1 : text.size() <= 8 ? 2 : 3;
  std::string nearest;
  size_t least = most + 1;
  for (const std::string& name : names) {
    const std::string candidate = Normalized(name);
    size_t distance = Distance(text, candidate);
    if (text.size() >= 3 && candidate.starts_with(text)) distance = std::min<size_t>(distance, 1);
    if (distance >= least) continue;
    least = distance;
    nearest = name;
  }
  return nearest;
}

}  // namespace semfoam
