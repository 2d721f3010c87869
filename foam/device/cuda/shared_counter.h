// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"

#include <cstdint>
#ifndef __CUDA_ARCH__
#include <atomic>
#endif

// Communication between the threads of a kernel, on a GPU and on the CPU. Results that use it do
// not depend on the order of the threads.

namespace semfoam {

// Returns the counter's value and increments it.
SEMFOAM_HOST_DEVICE inline uint32_t TakeNumber(uint32_t* counter) {
#ifdef __CUDA_ARCH__
  return atomicAdd(counter, 1u);
#else
  return std::atomic_ref(*counter).fetch_add(1, std::memory_order_relaxed);
#endif
}

// Raises a flag that several threads may raise.
SEMFOAM_HOST_DEVICE inline void Raise(uint8_t* flag) {
#ifdef __CUDA_ARCH__
  *flag = 1;
#else
  std::atomic_ref(*flag).store(1, std::memory_order_relaxed);
#endif
}

}  // namespace semfoam
