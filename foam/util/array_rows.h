// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/parallel.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

// Reorders and resizes arrays with one row of elements per site. Both functions run in parallel and
// hold the old and the new array at the same time, so large arrays are best changed one after the
// other. `Vector` is std::vector or has its interface.

namespace semfoam {

// Gathers rows of `stride` elements: row k of the result is the old row origin[k], which must
// exist; rows may be repeated and left out. `values`: [rows][stride] before,
// [origin.size()][stride] afterwards. An empty array stays empty.
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

// Returns `values` [rows][old_stride] as an array [rows][new_stride]: the first `num_kept` elements
// of each row are copied, the others are zero. `num_kept` is at most either stride.
template <typename Vector>
Vector ResizeRows(const Vector& values, size_t old_stride, size_t num_kept, size_t new_stride) {
  const size_t num_rows = values.size() / old_stride;
  Vector out(num_rows * new_stride);
  ParallelForBlocks(num_rows, 4096, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      std::copy_n(&values[k * old_stride], num_kept, &out[k * new_stride]);
    }
  });
  return out;
}

}  // namespace semfoam
