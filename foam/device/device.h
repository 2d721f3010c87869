// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/device_kind.h"

#include <optional>
#include <string>

// Where rays are cast and foams trained: on the CPU, or on a GPU
// (foam/device/cuda/, in programs built with SEMFOAM_CUDA). Chosen once for the process, as the
// number of threads is. What works there is made by device_factory.h.

namespace semfoam {

// "cpu"; "cuda:N", the N-th GPU; "auto": the first GPU that is there, else the CPU. Until it is
// called the CPU are in use. Throws UserError, one sentence, where there is no such device or
// this program knows none of its kind. Not while anything made for a device is there.
void UseDevice(const std::string& device);

// The number of the GPU in use; nothing: the CPU.
std::optional<int> CudaDeviceInUse();

// The kind of the device in use.
DeviceKind DeviceKindInUse();

// The device in use, in words: "2 threads", "cuda:0 (its name, its memory)".
std::string DeviceInWords();

// What `device` is where there are so many GPUs (nothing: in a program built without CUDA): the
// number of a GPU, or nothing for the CPU. Throws UserError as UseDevice does.
std::optional<int> FindCudaDevice(const std::string& device, std::optional<int> num_cuda_devices);

}  // namespace semfoam
