// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

namespace semfoam {

// Returns the seconds from `begin` until now, by a monotonic clock.
inline double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace semfoam
