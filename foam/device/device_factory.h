// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/optim/training_device.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"

#include <memory>

namespace semfoam {

// Makes the TrainingDevice that trains the foam in `state` on `device`. `state` must outlive it;
// Upload() and UploadTopology() copy state and topology to the device. Throws UserError where the
// device has too little memory.
std::unique_ptr<TrainingDevice> MakeTrainingDevice(const Device& device, TrainingState* state);

// Makes the RayCaster that renders a foam on `device`. The arrays of `geometry`, `shading` and
// `classifier` must outlive the caster and must not change. Throws UserError where the device has
// too little memory.
std::unique_ptr<RayCaster> MakeRayCaster(const Device& device,
                                         const WalkGeometry<float>& geometry,
                                         const CellShading<float>& shading,
                                         const ClassifierView<float>& classifier);

}  // namespace semfoam
