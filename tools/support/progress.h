// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <ostream>
#include <string>

namespace semfoam {

// "iteration 1200/4882, 23410 sites, 98 k rays/s, held-out 22.31 dB, 1:12 left"; what is not known
// (NaN) is left out.
std::string FormatProgress(const TrainingProgress& progress, double rays_per_second);

// Seconds as people read them: 0:07, 12:30, 1:02:03.
std::string FormatDuration(double seconds);

// One progress line. On a terminal it is redrawn in place; anywhere else a plain line is written
// every `seconds_between_lines` of training, and one for the end.
class ProgressLine {
 public:
  ProgressLine(std::ostream& out, bool is_terminal, double seconds_between_lines = 10);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void Update(const TrainingProgress& progress);
  // The same for other work, of which `text` is how far it has come `seconds` after its beginning.
  // On a terminal it is redrawn ten times a second at most.
  void Show(const std::string& text, double seconds);
  // Takes the line off the terminal, where others are to stand.
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
