// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "foam/train/trainer.h"

namespace semfoam {

// The presets, from the fastest to the best.
enum class Quality { kLow, kMedium, kHigh, kExtreme };
inline constexpr EnumName<Quality> kQualityNames[] = {{Quality::kLow, "low"},
                                                      {Quality::kMedium, "medium"},
                                                      {Quality::kHigh, "high"},
                                                      {Quality::kExtreme, "extreme"}};

// Returns the options of a preset: numbers of rays and sites, never seconds, so that the result
// does not depend on the speed of the machine.
TrainingOptions OptionsForQuality(Quality quality);

}  // namespace semfoam
