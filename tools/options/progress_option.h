// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"

namespace semfoam {

// Adds --progress, for commands that show their progress; Parse calls SetProgressStyle.
void AddProgressOption(OptionManager* options);

}  // namespace semfoam
