// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cuda_runtime.h>
#include <glog/logging.h>

namespace semfoam {

// CHECKs that a call of CUDA succeeded; `what` names the call. Throws UserError where the GPU has
// too little memory, which the user can change.
inline void CheckCuda(cudaError_t error, const char* what) {
  if (error == cudaErrorMemoryAllocation) {
    throw UserError(
        "The GPU has too little free memory; fewer sites (final_sites), fewer rays at a time "
        "(rays_per_iteration) or the device cpu would be right.");
  }
  CHECK_EQ(error, cudaSuccess) << what << ": " << cudaGetErrorString(error);
}

template <typename Kernel>
__global__ void __launch_bounds__(128) RunKernel(int64_t count, const Kernel kernel) {
  const int64_t stride = int64_t{gridDim.x} * blockDim.x;
  for (int64_t i = int64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += stride) {
    kernel(i);
  }
}

// Implements the interface of HostMachine on a GPU. All operations of one machine run in the order
// of their calls (in one CUDA stream).
class CudaMachine {
 public:
  explicit CudaMachine(int device) : device_(device) {
    Use();
    CheckCuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
  }
  ~CudaMachine() {
    cudaSetDevice(device_);
    cudaStreamDestroy(stream_);
  }
  CudaMachine(const CudaMachine&) = delete;
  CudaMachine& operator=(const CudaMachine&) = delete;

  template <typename T>
  class Array {
   public:
    Array() = default;
    ~Array() { cudaFree(memory_); }
    Array(const Array&) = delete;
    Array& operator=(const Array&) = delete;
    friend void swap(Array& a, Array& b) {
      std::swap(a.memory_, b.memory_);
      std::swap(a.size_, b.size_);
      std::swap(a.capacity_, b.capacity_);
    }

    // Resizes the array; its contents are lost. Allocates only when it grows.
    void Resize(size_t size) {
      if (size > capacity_) {
        CheckCuda(cudaFree(memory_), "cudaFree");
        memory_ = nullptr;
        capacity_ = size_ = 0;
        CheckCuda(cudaMalloc(reinterpret_cast<void**>(&memory_), size * sizeof(T)), "cudaMalloc");
        capacity_ = size;
      }
      size_ = size;
    }
    size_t size() const { return size_; }
    T* data() { return memory_; }
    const T* data() const { return memory_; }

   private:
    T* memory_ = nullptr;
    size_t size_ = 0;
    size_t capacity_ = 0;
  };

  template <typename T>
  void Upload(const T* values, size_t count, Array<T>* array, size_t at = 0) const {
    CHECK_LE(at + count, array->size());
    if (count == 0) return;
    Use();
    CheckCuda(cudaMemcpyAsync(
                  array->data() + at, values, count * sizeof(T), cudaMemcpyHostToDevice, stream_),
              "copying to the GPU");
    // The caller may change the values as soon as this returns.
    CheckCuda(cudaStreamSynchronize(stream_), "copying to the GPU");
  }
  template <typename T>
  void Download(const Array<T>& array, size_t count, T* values) const {
    CHECK_LE(count, array.size());
    if (count == 0) return;
    Use();
    CheckCuda(
        cudaMemcpyAsync(values, array.data(), count * sizeof(T), cudaMemcpyDeviceToHost, stream_),
        "copying from the GPU");
    CheckCuda(cudaStreamSynchronize(stream_), "the kernels before a copy from the GPU");
  }
  template <typename T>
  void Clear(Array<T>* array) const {
    if (array->size() == 0) return;
    Use();
    CheckCuda(cudaMemsetAsync(array->data(), 0, array->size() * sizeof(T), stream_), "clearing");
  }

  template <typename Kernel>
  void ForEach(int64_t count, const Kernel& kernel) const {
    if (count == 0) return;
    Use();
    constexpr int kThreads = 128;
    const int64_t blocks = std::min<int64_t>((count + kThreads - 1) / kThreads, 1 << 30);
    RunKernel<<<static_cast<unsigned>(blocks), kThreads, 0, stream_>>>(count, kernel);
    CheckCuda(cudaGetLastError(), "launching a kernel");
  }

  void SumBefore(const Array<uint32_t>& counts, size_t count, Array<uint32_t>* sums) {
    Use();
    size_t bytes = 0;
    const auto run = [&](void* scratch) {
      CheckCuda(
          cub::DeviceScan::ExclusiveSum(
              scratch, bytes, counts.data(), sums->data(), static_cast<int64_t>(count), stream_),
          "summing");
    };
    run(nullptr);
    run(Scratch(bytes));
  }

  void SortPairs(size_t count, int key_bits, Array<uint32_t>* keys, Array<uint32_t>* values) {
    Use();
    sorted_keys_.Resize(keys->size());
    sorted_values_.Resize(values->size());
    size_t bytes = 0;
    const auto run = [&](void* scratch) {
      CheckCuda(cub::DeviceRadixSort::SortPairs(scratch,
                                                bytes,
                                                keys->data(),
                                                sorted_keys_.data(),
                                                values->data(),
                                                sorted_values_.data(),
                                                static_cast<int64_t>(count),
                                                0,
                                                key_bits,
                                                stream_),
                "sorting");
    };
    run(nullptr);
    run(Scratch(bytes));
    swap(*keys, sorted_keys_);
    swap(*values, sorted_values_);
  }

 private:
  // CUDA keeps the current GPU per calling thread.
  void Use() const { CheckCuda(cudaSetDevice(device_), "cudaSetDevice"); }

  void* Scratch(size_t bytes) {
    scratch_.Resize(bytes);
    return scratch_.data();
  }

  int device_;
  cudaStream_t stream_ = nullptr;
  Array<uint32_t> sorted_keys_, sorted_values_;
  Array<uint8_t> scratch_;
};

}  // namespace semfoam
