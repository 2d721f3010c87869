// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Returns the text of training_log.csv: a head line, then one line per report: seconds, iteration,
// rays, sites, the losses, held_out_psnr, held_out_miou, distance_loss. Unknown values are empty
// fields.
std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports);

// Reads a file with the text of FormatTrainingLog, at the precision of its digits; it lacks
// seconds_left and num_iterations, and may lack distance_loss in all lines. Throws UserError where
// the file has another form.
std::vector<TrainingProgress> ReadTrainingLog(const std::filesystem::path& path);

}  // namespace semfoam
