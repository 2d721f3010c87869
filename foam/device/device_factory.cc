// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/device/device_factory.h"

#include "foam/device/cpu_device.h"

#ifdef SEMFOAM_HAS_CUDA
#include "foam/device/cuda/cuda_device.h"
#endif

namespace semfoam {

std::unique_ptr<TrainingDevice> MakeTrainingDevice([[maybe_unused]] const Device& device,
                                                   TrainingState* state) {
#ifdef SEMFOAM_HAS_CUDA
  if (const auto gpu = device.gpu()) return MakeCudaTrainingDevice(*gpu, state);
#endif
  return MakeCpuTrainingDevice(state);
}

std::unique_ptr<RayCaster> MakeRayCaster([[maybe_unused]] const Device& device,
                                         const WalkGeometry<float>& geometry,
                                         const CellShading<float>& shading,
                                         const ClassifierView<float>& classifier) {
#ifdef SEMFOAM_HAS_CUDA
  if (const auto gpu = device.gpu()) {
    return MakeCudaRayCaster(*gpu, geometry, shading, classifier);
  }
#endif
  return MakeCpuRayCaster(geometry, shading, classifier);
}

}  // namespace semfoam
