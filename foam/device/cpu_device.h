// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"
#include "foam/util/rank_group.h"

#include <memory>

// Implements the devices of device_factory.h on the CPU. They work on the host's state in place:
// only data derived from it is copied or computed.

namespace semfoam {

// With `ranks`, this is one of several processes that share the rays of each step.
std::unique_ptr<TrainingDevice> MakeCpuTrainingDevice(TrainingState* state,
                                                      RankGroup* ranks = nullptr);

std::unique_ptr<RayCaster> MakeCpuRayCaster(const WalkGeometry<float>& geometry,
                                            const CellShading<float>& shading,
                                            const ClassifierView<float>& classifier);

}  // namespace semfoam
