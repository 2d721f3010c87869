// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"

#include <memory>
#include <string>

// Devices for NVIDIA GPUs, in programs built with SEMFOAM_CUDA. Other code uses device_factory.h,
// which every build has.

namespace semfoam {

// Returns the number of GPUs; 0 without a driver.
int NumCudaDevices();

// Returns a description such as "cuda:0 (NVIDIA H200, 140 GB)".
std::string CudaDeviceDescription(int device);

// Make the devices of MakeTrainingDevice and MakeRayCaster (device_factory.h). `device` is below
// NumCudaDevices(). Throw UserError where the GPU has too little memory.
std::unique_ptr<TrainingDevice> MakeCudaTrainingDevice(int device, TrainingState* state);
std::unique_ptr<RayCaster> MakeCudaRayCaster(int device,
                                             const WalkGeometry<float>& geometry,
                                             const CellShading<float>& shading,
                                             const ClassifierView<float>& classifier);

}  // namespace semfoam
