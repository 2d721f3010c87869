// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace semfoam {

// The learning rate over a run, in fractions of the run (0 = start, 1 = end): rises linearly from 0
// during the warm-up, falls along a half cosine from `initial` to `final` at `end`, and is 0 after
// that (Radiant Foam's schedule).
struct CosineSchedule {
  double initial = 0;
  double final = 0;
  double warm_up = 0;
  double end = 1;

  double At(double progress) const {
    if (progress > end) return 0;
    if (progress < warm_up) return initial * progress / warm_up;
    const double phase = end > warm_up ? (progress - warm_up) / (end - warm_up) : 1;
    return final + 0.5 * (initial - final) * (1 + std::cos(std::numbers::pi * phase));
  }
};

}  // namespace semfoam
