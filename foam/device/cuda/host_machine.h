// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/parallel.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

// Implements on the CPU, for tests only, the interface through which GpuTraining and GpuCaster use
// a GPU. Kernels run in parallel, and access only the memory passed to them.
class HostMachine {
 public:
  // An array in the GPU's memory. Borrowed by kernels through data().
  template <typename T>
  class Array {
   public:
    // Resizes the array. Its contents are lost, unless it already has that size.
    void Resize(size_t size) {
      if (size == size_) return;
      memory_ = std::make_unique<T[]>(size);
      size_ = size;
    }
    size_t size() const { return size_; }
    T* data() { return memory_.get(); }
    const T* data() const { return memory_.get(); }

   private:
    std::unique_ptr<T[]> memory_;
    size_t size_ = 0;
  };

  template <typename T>
  void Upload(const T* values, size_t count, Array<T>* array, size_t at = 0) const {
    CHECK_LE(at + count, array->size());
    std::copy_n(values, count, array->data() + at);
  }
  template <typename T>
  void Download(const Array<T>& array, size_t count, T* values) const {
    CHECK_LE(count, array.size());
    std::copy_n(array.data(), count, values);
  }
  // Sets all bytes to zero.
  template <typename T>
  void Clear(Array<T>* array) const {
    std::memset(static_cast<void*>(array->data()), 0, array->size() * sizeof(T));
  }

  // Calls kernel(i) for i in [0, count), in any order.
  template <typename Kernel>
  void ForEach(int64_t count, const Kernel& kernel) const {
    ParallelForBlocks(count, 64, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) kernel(i);
    });
  }

  // Computes the exclusive prefix sums: sums[i] = counts[0] + ... + counts[i - 1].
  void SumBefore(const Array<uint32_t>& counts, size_t count, Array<uint32_t>* sums) const {
    std::exclusive_scan(counts.data(), counts.data() + count, sums->data(), uint32_t{0});
  }

  // Sorts pairs stably by keys of `key_bits` bits.
  void SortPairs(size_t count, int key_bits, Array<uint32_t>* keys, Array<uint32_t>* values) {
    std::vector<uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return keys->data()[a] < keys->data()[b];
    });
    const std::vector<uint32_t> old_keys(keys->data(), keys->data() + count);
    const std::vector<uint32_t> old_values(values->data(), values->data() + count);
    for (size_t i = 0; i < count; ++i) {
      keys->data()[i] = old_keys[order[i]];
      values->data()[i] = old_values[order[i]];
      CHECK_EQ(uint64_t{keys->data()[i]} >> key_bits, 0u);
    }
  }
};

}  // namespace semfoam
