// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/ray_caster.h"
#include "foam/ray_loss.h"
#include "foam/ray_record.h"
#include "foam/training_device.h"
#include "foam/walk.h"

#include <memory>
#include <optional>
#include <string>

// The one place that knows where rays are cast and foams trained: on the machine's cores, or on a
// graphics card (foam/cuda/, in programs built with SEMFOAM_CUDA). Chosen once for the process, as
// the number of threads is.

namespace semfoam {

// "cpu"; "cuda:N", the N-th card; "auto": the first card that is there, else the cores. Until it is
// called the cores are in use. Throws UserError, one sentence, where there is no such device or
// this program knows none of its kind. Not while anything made by a device is there.
void UseDevice(const std::string& device);

// The kind of the device in use.
DeviceKind DeviceKindInUse();

// The device in use, in words: "2 threads", "cuda:0 (its name, its memory)".
std::string DeviceInWords();

// Ready to train the foam in `state`, which must outlive it; takes over state and topology with
// Upload() and UploadTopology().
std::unique_ptr<TrainingDevice> MakeTrainingDevice(TrainingState* state);

// Ready to show a foam. What the three refer to must outlive the caster and stay as it is.
std::unique_ptr<RayCaster> MakeRayCaster(const WalkGeometry<float>& geometry,
                                         const CellShading<float>& shading,
                                         const ClassifierView<float>& classifier);

// What `device` is where there are so many cards (nothing: in a program built without CUDA): the
// number of a card, or nothing for the cores. Throws UserError as UseDevice does.
std::optional<int> FindCudaDevice(const std::string& device, std::optional<int> num_cuda_devices);

}  // namespace semfoam
