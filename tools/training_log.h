// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/trainer.h"

#include <string>
#include <vector>

namespace semfoam {

// training_log.csv: a head line, then one line per report: seconds, iteration, rays, sites, the
// losses, held_out_psnr. What is not known is an empty field.
std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports);

}  // namespace semfoam
