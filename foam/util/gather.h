// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/parallel.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace semfoam {

// Rearranges rows of `stride` elements: new row k is old row origin[k]. An empty array stays empty.
// Holds the old and the new array for a moment, so rearrange one array at a time.
template <typename Vector>
void Gather(const std::vector<uint32_t>& origin, size_t stride, Vector* values) {
  if (values->empty()) return;
  Vector out(origin.size() * stride);
  ParallelForBlocks(origin.size(), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      std::copy_n(&(*values)[origin[k] * stride], stride, &out[k * stride]);
    }
  });
  *values = std::move(out);
}

// Rows of another length: the first `kept` elements of each stay, the rest is zero.
template <typename Vector>
Vector WithStride(const Vector& values, size_t old_stride, size_t kept, size_t new_stride) {
  const size_t num_rows = values.size() / old_stride;
  Vector out(num_rows * new_stride);
  ParallelForBlocks(num_rows, 4096, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      std::copy_n(&values[k * old_stride], kept, &out[k * new_stride]);
    }
  });
  return out;
}

}  // namespace semfoam
