// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"

#include <nlohmann/json_fwd.hpp>

namespace semfoam {

// Adds --json, for commands that print a table.
void AddJsonOption(OptionManager* options, bool* json);

// Prints a document to stdout; bytes that are not UTF-8 become U+FFFD.
void PrintJson(const nlohmann::ordered_json& json);

}  // namespace semfoam
