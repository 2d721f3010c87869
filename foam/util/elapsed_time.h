// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

namespace semfoam {

// Seconds from `begin` until now, by a clock that never goes back.
inline double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace semfoam
