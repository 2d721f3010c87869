// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

// Returns the median of `values`; of an even number of them the higher of the two in the middle.
// CHECKs that there is one.
template <typename T>
T Median(std::vector<T> values) {
  CHECK(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace semfoam
