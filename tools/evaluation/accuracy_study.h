// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "tools/images/plot.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// A training of the study: the base, a preset, or the base with one thing changed.
struct StudyRun {
  std::string sweep;  // "base", "preset", or the option that is changed
  std::string value;  // what it is changed to
  TrainingOptions training;
  int max_image_size = -1;  // as SceneOptions has it
};

// The base with one option changed at a time: rays, sites, photos' size, SH degree, transmittance
// cut-off; the first change of each comes before the second of any, so that a study cut short has
// something of each. `longest_side`: of the photos, in pixels.
std::vector<StudyRun> SweepsAround(const TrainingOptions& base, int longest_side);

// One row of the table. NaN = not known.
struct AccuracyRow {
  std::string sweep;
  std::string value;
  int64_t rays = 0;
  int64_t sites = 0;
  int sh_degree = 0;
  int image_size = 0;  // longest side of the photos trained on, pixels
  double transmittance_cutoff = 0;
  double seconds = NAN;  // training, and for exports the export too
  double psnr = NAN;     // dB, held-out photos at full size
  double ssim = NAN;
  double miou = NAN;
  double surface_error = NAN;  // world units, see surface_error.h
};

// The points that no other point beats, by ascending x: less x (seconds), and more of y or, with
// `less_is_better`, less. Points that are not finite are left out; of equal points one is kept.
std::vector<PlotPoint> ParetoFront(std::vector<PlotPoint> points, bool less_is_better);

// A head line, then a line per row; what is not known is an empty field.
std::string FormatAccuracyCsv(const std::vector<AccuracyRow>& rows);
// A Markdown table; a training's figure on the Pareto front of its column against seconds is set
// bold.
std::string FormatAccuracyTable(const std::vector<AccuracyRow>& rows);
// A panel for each of PSNR, mIoU and surface error that is known, against seconds. The sweeps are
// lines that lead through the base, the first row; those of exports (rows without PSNR) stand for
// themselves, and are on no front.
Plot AccuracyPlot(const std::vector<AccuracyRow>& rows);

}  // namespace semfoam
