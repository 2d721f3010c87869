// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/benchmark/peak_memory.h"

#include "foam/util/freed_memory.h"

#include <algorithm>
#include <fstream>
#include <string>

namespace semfoam {
namespace {

// A line of /proc/self/status, "VmHWM:  1234 kB", in bytes; 0 where there is none.
int64_t StatusBytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    int64_t kilobytes = 0;
    if (word == name && status >> kilobytes) return 1024 * kilobytes;
  }
  return 0;
}

}  // namespace

PeakMemory::PeakMemory() {
  // What was freed before must not hide what is asked for now.
  ReturnFreedMemory();
  held_ = StatusBytes("VmRSS:");
  // 5 sets the mark to what is held now (proc(5)).
  std::ofstream mark("/proc/self/clear_refs");
  mark << 5 << std::flush;
  if (!mark) held_ = 0;
}

int64_t PeakMemory::BytesAbove() const {
  return held_ == 0 ? 0 : std::max<int64_t>(0, StatusBytes("VmHWM:") - held_);
}

}  // namespace semfoam
