// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tests/tools/program.h"

namespace semfoam {

// Runs the program mask_corrupter (commands/mask_corrupter.cc), which damages masks as trackers do.
inline Outcome RunMaskCorrupter(const std::vector<std::string>& arguments) {
  return RunProgram(SEMFOAM_MASK_CORRUPTER, arguments);
}

}  // namespace semfoam
