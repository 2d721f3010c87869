// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Marks functions that the CPU and a GPU both call. The compiler of foam/device/cuda/ generates
// code for both from the same source; for any other compiler the mark is empty.
#if defined(__CUDACC__) || defined(__CUDA__)
#define SEMFOAM_HOST_DEVICE __host__ __device__
#else
#define SEMFOAM_HOST_DEVICE
#endif
