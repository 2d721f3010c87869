// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/device_kind.h"

#include <optional>
#include <string>

namespace semfoam {

// Names the device that casts rays and trains foams: the CPU, or one GPU (foam/device/cuda/,
// experimental, in programs built with SEMFOAM_CUDA). A value type, passed to ViewRenderer and in
// TrainingHooks; device_factory.h makes the implementations.
class Device {
 public:
  // Names the CPU.
  Device() = default;

  // Finds the device called `name`: "cpu"; "cuda:N", the GPU of that number, counted from 0;
  // "auto", the first GPU that CUDA can use, or the CPU. Throws FieldError for the field "device",
  // one sentence, where there is no such device or this program was built without CUDA.
  static Device Find(const std::string& name);

  // Does the same for a machine with `num_gpus` GPUs; nothing: for a program built without CUDA.
  static Device Find(const std::string& name, std::optional<int> num_gpus);

  // Returns the number of the GPU; nothing for the CPU.
  std::optional<int> gpu() const { return gpu_; }
  DeviceKind kind() const { return gpu_ ? DeviceKind::kGpu : DeviceKind::kCpu; }

  // Returns a description for the log: "2 threads" (NumThreads), "cuda:0 (its name, its memory)".
  std::string Description() const;

 private:
  std::optional<int> gpu_;
};

}  // namespace semfoam
