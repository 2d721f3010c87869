// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace semfoam {

// Measures the peak memory of the process above its memory at construction (VmHWM of Linux, which
// the constructor resets).
class PeakMemory {
 public:
  PeakMemory();

  // Returns the difference in bytes; 0 where the system does not report it.
  int64_t BytesAbove() const;

 private:
  int64_t held_;
};

}  // namespace semfoam
