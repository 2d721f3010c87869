// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

namespace semfoam {

// Draws the held-out quality of several trainings over their seconds, as quality_over_seconds.svg
// and .png in `output_path`, from the training_log.csv of each of `run_paths` (folders, apart by
// commas). `names` calls them, as many and in the same order; empty = by their folders. Prints one
// line. Throws UserError where a log cannot be read, two trainings have one name, the numbers of
// names and trainings differ, or no training knows its held-out quality.
void PlotTrainings(const std::string& run_paths,
                   const std::string& names,
                   const std::filesystem::path& output_path);

}  // namespace semfoam
