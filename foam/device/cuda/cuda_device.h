// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"

#include <memory>
#include <string>

// NVIDIA's GPUs. Only in programs built with SEMFOAM_CUDA; see device_factory.h, which is for
// everybody.

namespace semfoam {

// The GPUs that there are; 0 also where there is no driver.
int NumCudaDevices();

// "cuda:0 (NVIDIA H200, 140 GB)".
std::string CudaDeviceDescription(int device);

// See MakeTrainingDevice and MakeRayCaster. `device` is one of NumCudaDevices. Throws UserError
// where the GPU has too little memory.
std::unique_ptr<TrainingDevice> MakeCudaTrainingDevice(int device, TrainingState* state);
std::unique_ptr<RayCaster> MakeCudaRayCaster(int device,
                                             const WalkGeometry<float>& geometry,
                                             const CellShading<float>& shading,
                                             const ClassifierView<float>& classifier);

}  // namespace semfoam
