// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace semfoam {

// Starts to load the lines with these bytes into the CPU's cache; `kWrites`: to be written as well.
// For memory that is read in an order that the CPU cannot foresee.
template <bool kWrites = false>
inline void Prefetch(const void* memory, size_t bytes) {
  constexpr size_t kLine = 64;
  const char* const first = static_cast<const char*>(memory);
  for (size_t at = 0; at < bytes; at += kLine) __builtin_prefetch(first + at, kWrites);
  __builtin_prefetch(first + bytes - 1, kWrites);
}

}  // namespace semfoam
