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

// The GPU in use; none: the CPU.
std::optional<int> cuda_device;

std::optional<int> CudaDevices() {
#ifdef SEMFOAM_HAS_CUDA
  return NumCudaDevices();
#else
  return std::nullopt;
#endif
}

}  // namespace

std::optional<int> FindCudaDevice(const std::string& device, std::optional<int> num_cuda_devices) {
  if (device == "cpu") return std::nullopt;
  if (device == "auto") {
    return num_cuda_devices.value_or(0) > 0 ? std::optional<int>(0) : std::nullopt;
  }
  uint32_t number = 0;
  const bool is_gpu =
      device.starts_with(kCuda) && ParseNumber(device.substr(sizeof(kCuda) - 1), &number);
  if (!is_gpu) {
    throw UserError("Failed to parse options - the argument ('",
                    Shortened(device),
                    "') for option '--device' is invalid; it takes auto, cpu or cuda:N, the "
                    "GPU of that number from 0 on.");
  }
  if (!num_cuda_devices.has_value()) {
    throw UserError("--device ",
                    device,
                    ": this program was built without CUDA; build it with -DSEMFOAM_CUDA=ON, or "
                    "use --device cpu.");
  }
  if (*num_cuda_devices == 0) {
    throw UserError("--device ",
                    device,
                    ": there is no GPU here that CUDA can use; --device cpu or auto "
                    "would be right.");
  }
  if (number >= static_cast<uint32_t>(*num_cuda_devices)) {
    throw UserError("--device ",
                    device,
                    ": there is no GPU of that number; ",
                    *num_cuda_devices == 1
                        ? std::string("cuda:0")
                        : "cuda:0 to cuda:" + std::to_string(*num_cuda_devices - 1),
                    " would be right.");
  }
  return static_cast<int>(number);
}

void UseDevice(const std::string& device) {
  // GPUs are only asked for where they matter: that takes a moment.
  cuda_device = FindCudaDevice(device, device == "cpu" ? std::nullopt : CudaDevices());
}

std::optional<int> CudaDeviceInUse() { return cuda_device; }

DeviceKind DeviceKindInUse() { return cuda_device ? DeviceKind::kGpu : DeviceKind::kCores; }

std::string DeviceInWords() {
#ifdef SEMFOAM_HAS_CUDA
  if (cuda_device) return CudaDeviceInWords(*cuda_device);
#endif
  return std::to_string(NumThreads()) + (NumThreads() == 1 ? " thread" : " threads");
}

}  // namespace semfoam
