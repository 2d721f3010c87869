// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <ostream>
#include <string>

namespace semfoam {

// How progress is displayed.
enum class ProgressStyle {
  // kBar where stderr is a terminal, else kLines.
  kAuto,
  // One line that is redrawn in place: a bar, percent, the time left, the quality on held-out
  // photos.
  kBar,
  // A plain line now and then.
  kLines,
  // A JSON object a line, once a second: "task", "share" (0 to 1) and "seconds"; "seconds_left"
  // where
  // known; of a training also "iteration", "num_iterations", "rays", "sites", and where known
  // "held_out_psnr" (dB) and "held_out_miou".
  kJson,
  // Not at all.
  kNone,
};

// Sets the style of all progress of this process. Must be called from the main thread, before the
// work.
void SetProgressStyle(ProgressStyle style);

// Returns the style in use: never kAuto.
ProgressStyle CurrentProgressStyle();

// Returns a text such as "iteration 1200/4882, 23410 sites, 98 k rays/s, held-out 22.31 dB, 1:12
// left", without unknown values (NaN).
std::string FormatProgress(const TrainingProgress& progress, double rays_per_second);

// Returns seconds in a readable form: 0:07, 12:30, 1:02:03.
std::string FormatDuration(double seconds);

// Progress of other work than a training.
struct WorkProgress {
  // "checking photos".
  std::string what;
  // Done part of the work, 0 to 1, after `seconds`.
  double share = 0;
  double seconds = 0;
  // Plain line.
  std::string line;
};

// Returns the progress of `done` of `total` things: "checking photos 3/64, 0:07 left".
WorkProgress CountProgress(const std::string& what, int done, int total, double seconds);

// Displays progress.
class ProgressLine {
 public:
  // On stderr, in the style of the process.
  ProgressLine();
  // `style` must not be kAuto. Plain lines are written every `seconds_between_lines` of the work,
  // and one at the end of a training. A bar's line is at most `columns` wide.
  ProgressLine(std::ostream& out,
               ProgressStyle style,
               double seconds_between_lines = 10,
               int columns = 80);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void Update(const TrainingProgress& progress);
  // Redraws a bar at most ten times a second.
  void Show(const WorkProgress& progress);
  // Erases a bar.
  void Clear();

 private:
  // Returns whether it is time for the next output of a style other than kBar.
  bool IsDue(double seconds) const;
  void Redraw(double share, double seconds_left, const std::string& text);

  std::ostream& out_;
  const ProgressStyle style_;
  const double seconds_between_lines_;
  const int columns_;
  TrainingProgress previous_;
  double seconds_at_last_line_ = 0;
  bool line_is_open_ = false;
};

}  // namespace semfoam
