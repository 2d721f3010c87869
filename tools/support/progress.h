// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <ostream>
#include <string>

namespace semfoam {

// Returns a text such as "iteration 1200/4882, 23410 sites, 98 k rays/s, held-out 22.31 dB, 1:12
// left", without unknown values (NaN).
std::string FormatProgress(const TrainingProgress& progress, double rays_per_second);

// Returns seconds in a readable form: 0:07, 12:30, 1:02:03.
std::string FormatDuration(double seconds);

// Displays one progress line. On a terminal it is redrawn in place; elsewhere a plain line is
// written every `seconds_between_lines` of training, and one at the end.
class ProgressLine {
 public:
  ProgressLine(std::ostream& out, bool is_terminal, double seconds_between_lines = 10);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void Update(const TrainingProgress& progress);
  // Displays the progress `text` of other work, `seconds` after its beginning. On a terminal,
  // redraws the line at most ten times a second.
  void Show(const std::string& text, double seconds);
  // Erases the line from the terminal.
  void Clear();

 private:
  void Redraw(const std::string& text);

  std::ostream& out_;
  const bool is_terminal_;
  const double seconds_between_lines_;
  TrainingProgress previous_;
  double seconds_at_last_line_ = 0;
  bool line_is_open_ = false;
};

}  // namespace semfoam
