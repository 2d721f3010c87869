// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Before a function that a GPU may call, too. The same source, so the same mathematics:
// the compiler of foam/device/cuda/ makes code of it for both, any other leaves it as it is.
#if defined(__CUDACC__) || defined(__CUDA__)
#define SEMFOAM_HOST_DEVICE __host__ __device__
#else
#define SEMFOAM_HOST_DEVICE
#endif
