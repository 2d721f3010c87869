// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "tools/controllers/training_folder.h"
#include "tools/images/plot.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// The reports of one training, under the name that a plot gives them.
struct TrainingCurve {
  std::string name;  // empty for one alone
  std::vector<TrainingProgress> reports;
};

// Held-out PSNR and, with labels, mIoU against seconds: a panel for each that is known of any
// curve. Seconds are in powers of ten where there are several, for one may last a minute and
// another two hours.
Plot TrainingPlot(const std::vector<TrainingCurve>& curves);

// Draws the held-out quality of several trainings over their seconds, as quality_over_seconds.svg
// and .png in `output_path`, from the training_log.csv of each of `run_paths` (folders, apart by
// commas). `names` calls them, as many and in the same order; empty = by their folders. Prints one
// line. Throws UserError where a log cannot be read, two trainings have one name, the numbers of
// names and trainings differ, or no training knows its held-out quality.
void PlotTrainings(const std::string& run_paths,
                   const std::string& names,
                   const std::filesystem::path& output_path);

// For TrainingRun::when_written: draws training_plot.svg and .png of one training into the folder.
// Without held-out views there is no quality to show: removes those of a foam that was there
// before.
void DrawTrainingPlot(const std::vector<TrainingProgress>& reports, const TrainingFolder& folder);

}  // namespace semfoam
