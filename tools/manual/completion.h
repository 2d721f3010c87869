// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/manual/manual_pages.h"

#include <string>
#include <vector>

namespace semfoam {

// Return scripts that complete the program's commands, options and the values of options that have
// choices; paths are completed as the shell completes files.
std::string BashCompletion(const std::vector<ManualCommand>& commands);
std::string ZshCompletion(const std::vector<ManualCommand>& commands);

}  // namespace semfoam
