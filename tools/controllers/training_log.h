// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// training_log.csv: a head line, then one line per report: seconds, iteration, rays, sites, the
// losses, held_out_psnr, held_out_miou. What is not known is an empty field.
std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports);

// What FormatTrainingLog wrote to the file, at the digits that stand there; seconds_left and
// num_iterations are not in it. Throws UserError where it is something else.
std::vector<TrainingProgress> ReadTrainingLog(const std::filesystem::path& path);

}  // namespace semfoam
