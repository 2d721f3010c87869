// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace semfoam {

// Returns the name that a misspelt one probably means: the one of `names` with the smallest number
// of inserted, left out, replaced and swapped characters, if that is at most 1 for up to four
// characters, 2 for up to eight, else 3; capitals and '-' for '_' do not count. A beginning of at
// least three characters ("output" for "output_path") counts as one change. The first of several
// that are equally near. Returns "" where no name is near.
std::string NearestName(const std::string& misspelt, const std::vector<std::string>& names);

}  // namespace semfoam
