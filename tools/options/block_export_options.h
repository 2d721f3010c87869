// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"

#include <set>
#include <string>

namespace semfoam {

// Adds --blocks_path for a command that exports, in place of --foam_path.
void AddBlocksPathOption(OptionManager* options, std::string* blocks_path);

// Throws UserError for an option that has no effect on an export block by block, and where there is
// no --output_path. `own` are the options of the command that have one, besides those of labels,
// components and frame.
void RequireByBlock(const OptionManager& options, const std::set<std::string>& own);

}  // namespace semfoam
