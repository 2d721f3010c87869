// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "tools/controllers/training_folder.h"
#include "tools/images/plot.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// The reports of one training, and its name in a plot.
struct TrainingCurve {
  // Empty for a single curve.
  std::string name;
  std::vector<TrainingProgress> reports;
};

// Returns a plot of held-out PSNR and, with labels, mIoU against seconds, with a panel for each
// that is known of any curve. The axis of the seconds is logarithmic for several curves, because
// their times may differ by orders of magnitude.
Plot TrainingPlot(const std::vector<TrainingCurve>& curves);

// Draws the held-out quality of several trainings over their seconds, as quality_over_seconds.svg
// and .png in `output_path`, from the training_log.csv of each of `run_paths` (comma-separated
// folders). `names` are their names, as many and in the same order; empty: use the folders' names.
// Prints one line. Throws UserError where a log cannot be read, two trainings have the same name,
// the numbers of names and trainings differ, or no training has a held-out quality.
void PlotTrainings(const std::string& run_paths,
                   const std::string& names,
                   const std::filesystem::path& output_path);

// Draws training_plot.svg and .png of one training into the folder, for TrainingRun::when_written.
// Without held-out views, removes the plots of an earlier foam instead.
void DrawTrainingPlot(const std::vector<TrainingProgress>& reports, const TrainingFolder& folder);

}  // namespace semfoam
