// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <vector>

#include <sys/mman.h>

namespace semfoam {

// Allocates arrays that are read at random places: aligned to a cache line for vector loads, and
// large ones to 2 MiB with the advice to use huge pages. A ray reads planes from all over tens of
// megabytes; with pages of 4 KiB nearly every read would also miss the TLB.
template <typename T>
struct LargePageAllocator {
  using value_type = T;

  LargePageAllocator() = default;
  template <typename U>
  LargePageAllocator(const LargePageAllocator<U>&) {}

  T* allocate(size_t count) {
    constexpr size_t kLine = 64, kHugePage = size_t{2} << 20;
    if (count > size_t{PTRDIFF_MAX} / 2 / sizeof(T)) throw std::bad_alloc();
    const size_t alignment = count * sizeof(T) >= 2 * kHugePage ? kHugePage : kLine;
    const size_t bytes = (count * sizeof(T) + alignment - 1) / alignment * alignment;
    void* memory = std::aligned_alloc(alignment, bytes);
    if (memory == nullptr) throw std::bad_alloc();
    if (alignment == kHugePage) ::madvise(memory, bytes, MADV_HUGEPAGE);  // a wish, no more
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, size_t) { std::free(memory); }

  template <typename U>
  bool operator==(const LargePageAllocator<U>&) const {
    return true;
  }
};

template <typename T>
using LargePageVector = std::vector<T, LargePageAllocator<T>>;

}  // namespace semfoam
