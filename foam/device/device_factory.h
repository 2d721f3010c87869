// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"

#include <memory>

// What casts rays and trains foams, on the device in use (device.h).

namespace semfoam {

// Ready to train the foam in `state`, which must outlive it; takes over state and topology with
// Upload() and UploadTopology().
std::unique_ptr<TrainingDevice> MakeTrainingDevice(TrainingState* state);

// Ready to show a foam. What the three refer to must outlive the caster and stay as it is.
std::unique_ptr<RayCaster> MakeRayCaster(const WalkGeometry<float>& geometry,
                                         const CellShading<float>& shading,
                                         const ClassifierView<float>& classifier);

}  // namespace semfoam
