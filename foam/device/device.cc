// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/device/device.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/number_text.h"
#include "foam/util/parallel.h"

#include <cstdint>

#ifdef SEMFOAM_HAS_CUDA
#include "foam/device/cuda/cuda_device.h"
#endif

namespace semfoam {
namespace {

constexpr char kCuda[] = "cuda:";

std::optional<int> NumGpus() {
#ifdef SEMFOAM_HAS_CUDA
  return NumCudaDevices();
#else
  return std::nullopt;
#endif
}

}  // namespace

Device Device::Find(const std::string& name) {
  // Asks for GPUs only where they matter: that takes a moment.
  return Find(name, name == "cpu" ? std::nullopt : NumGpus());
}

Device Device::Find(const std::string& name, std::optional<int> num_gpus) {
  Device device;
  if (name == "cpu") return device;
  if (name == "auto") {
    if (num_gpus.value_or(0) > 0) device.gpu_ = 0;
    return device;
  }
  uint32_t number = 0;
  if (!name.starts_with(kCuda) || !ParseNumber(name.substr(sizeof(kCuda) - 1), &number)) {
    throw FieldError("device",
                     " is '",
                     Shortened(name),
                     "'; it takes auto, cpu or cuda:N, the GPU of that number from 0 on.");
  }
  if (!num_gpus.has_value()) {
    throw FieldError("device",
                     " is ",
                     name,
                     ", and this program was built without CUDA; build it with -DSEMFOAM_CUDA=ON, "
                     "or use cpu.");
  }
  if (*num_gpus == 0) {
    throw FieldError("device",
                     " is ",
                     name,
                     ", and there is no GPU here that CUDA can use; cpu or auto would be right.");
  }
  if (number >= static_cast<uint32_t>(*num_gpus)) {
    throw FieldError(
        "device",
        " is ",
        name,
        ", and there is no GPU of that number; ",
        *num_gpus == 1 ? std::string("cuda:0") : "cuda:0 to cuda:" + std::to_string(*num_gpus - 1),
        " would be right.");
  }
  device.gpu_ = static_cast<int>(number);
  return device;
}

std::string Device::Description() const {
#ifdef SEMFOAM_HAS_CUDA
  if (gpu_) return CudaDeviceDescription(*gpu_);
#endif
  return std::to_string(NumThreads()) + (NumThreads() == 1 ? " thread" : " threads");
}

}  // namespace semfoam
