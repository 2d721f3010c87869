// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "tools/images/plot.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// A training of the study: the base, a preset, or the base with one option changed.
struct StudyRun {
  // "base", "preset", or the name of the changed option.
  std::string sweep;
  // New value of the option.
  std::string value;
  TrainingOptions training;
  // SceneOptions::max_image_size.
  int max_image_size = -1;
  // Whether there is a plane sweep (TrainingRun::sweep_photos), where the base has one.
  bool sweeps = true;
};

// Returns runs of the base with one option changed at a time. First the amounts: rays, sites,
// photos' size, SH degree, transmittance cut-off. Then what can be left out, where the base has it:
// colour gradients, the colours' variation, the plane sweep (`base_sweeps`) and its distances. The
// first change of each option comes before the second of any, so that an interrupted study has
// results for each. `longest_side` is that of the photos, in pixels.
std::vector<StudyRun> SweepsAround(const TrainingOptions& base, int longest_side, bool base_sweeps);

// One row of the table. NaN: not known.
struct AccuracyRow {
  std::string sweep;
  std::string value;
  int64_t rays = 0;
  int64_t sites = 0;
  int sh_degree = 0;
  // Longest side of the training photos, pixels.
  int image_size = 0;
  double transmittance_cutoff = 0;
  // Time of the training, and for exports also of the export.
  double seconds = NAN;
  // In dB, on held-out photos at full size.
  double psnr = NAN;
  double ssim = NAN;
  double miou = NAN;
  // In world units (surface_error.h).
  double surface_error = NAN;
};

// Returns the Pareto-optimal points by ascending x: no other point has less x (seconds) and a
// better y, which is more or, with `less_is_better`, less. Leaves out points that are not finite;
// keeps one of equal points.
std::vector<PlotPoint> ParetoFront(std::vector<PlotPoint> points, bool less_is_better);

// Returns a head line, then a line per row; unknown values are empty fields.
std::string FormatAccuracyCsv(const std::vector<AccuracyRow>& rows);
// Returns a Markdown table; figures of trainings on the Pareto front of their column against
// seconds are bold.
std::string FormatAccuracyTable(const std::vector<AccuracyRow>& rows);
// Returns a plot with a panel for each of PSNR, mIoU and surface error that is known, against
// seconds. The sweeps are lines through the base, the first row; those of exports (rows without
// PSNR) are separate lines, and on no front.
Plot AccuracyPlot(const std::vector<AccuracyRow>& rows);

}  // namespace semfoam
