// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace semfoam {

// How much memory the process takes on top of what it holds when this is made, at its highest
// (VmHWM of Linux, whose mark is set back here).
class PeakMemory {
 public:
  PeakMemory();

  // Bytes; 0 where the system does not say.
  int64_t BytesAbove() const;

 private:
  int64_t held_;
};

}  // namespace semfoam
