// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/device/cuda/cuda_device.h"
#include "foam/device/cuda/cuda_machine.h"
#include "foam/device/cuda/gpu_caster.h"
#include "foam/device/cuda/gpu_training.h"

#include <cmath>

namespace semfoam {

int NumCudaDevices() {
  int count = 0;
  // Without a driver, or without a GPU, this is an error; both mean that there is none.
  if (cudaGetDeviceCount(&count) != cudaSuccess) {
    cudaGetLastError();
    return 0;
  }
  return count;
}

std::string CudaDeviceDescription(int device) {
  cudaDeviceProp properties;
  CheckCuda(cudaGetDeviceProperties(&properties, device), "cudaGetDeviceProperties");
  return "cuda:" + std::to_string(device) + " (" + properties.name + ", " +
         std::to_string(std::llround(properties.totalGlobalMem / 1e9)) + " GB)";
}

std::unique_ptr<TrainingDevice> MakeCudaTrainingDevice(int device, TrainingState* state) {
  return std::make_unique<GpuTraining<CudaMachine>>(state, device);
}

std::unique_ptr<RayCaster> MakeCudaRayCaster(int device,
                                             const WalkGeometry<float>& geometry,
                                             const CellShading<float>& shading,
                                             const ClassifierView<float>& classifier) {
  return std::make_unique<GpuCaster<CudaMachine>>(geometry, shading, classifier, device);
}

}  // namespace semfoam
