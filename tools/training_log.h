// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/trainer.h"
#include "tools/plot.h"

#include <string>
#include <vector>

namespace semfoam {

// training_log.csv: a head line, then one line per report: seconds, iteration, rays, sites, the
// losses, held_out_psnr, held_out_miou. What is not known is an empty field.
std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports);

// Held-out PSNR and, with labels, mIoU against seconds: a panel for each that is known.
Plot TrainingPlot(const std::vector<TrainingProgress>& reports);

}  // namespace semfoam
