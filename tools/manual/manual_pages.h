// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/command_description.h"

#include <string>
#include <vector>

namespace semfoam {

// A command as the manual shows it.
struct ManualCommand {
  // What it does in a few words.
  std::string brief;
  CommandDescription description;
};

// Returns all commands of the program.
std::vector<ManualCommand> AllManualCommands();

// The edition that a page names: the version and the date of the program.
struct ManualEdition {
  std::string version;
  // YYYY-MM-DD
  std::string date;
};

// Return pages in man(7)'s language, section 1: semfoam(1), which lists the commands, and
// semfoam-COMMAND(1), with every option.
std::string ProgramPage(const std::vector<ManualCommand>& commands, const ManualEdition& edition);
std::string CommandPage(const ManualCommand& command, const ManualEdition& edition);

// Returns the same as JSON, for programs that make other documents of it: [{"name", "brief",
// "summary", "options": [{"name", "short_names", "help", "group", "choices", "expected", "default",
// "required", "frequent", "general"}], "presets": [{"name", "choices", "options", "values"}]}].
std::string CommandsJson(const std::vector<ManualCommand>& commands);

}  // namespace semfoam
