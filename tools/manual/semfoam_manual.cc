// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "tools/cli/run_command.h"
#include "tools/manual/completion.h"
#include "tools/manual/manual_pages.h"

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

// Writes what the program's options tell of themselves, when it is built:
//   semfoam_manual FOLDER DATE
// into FOLDER/man1/*.1, FOLDER/completions/semfoam (bash) and _semfoam (zsh), FOLDER/commands.json.
// DATE, YYYY-MM-DD, stands on the pages.
int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  using semfoam::WriteTextFile;
  if (argc != 3) {
    return semfoam::PrintError("semfoam_manual takes a folder and a date, 2026-11-25.");
  }
  const fs::path folder = argv[1];
  const semfoam::ManualEdition edition{SEMFOAM_VERSION, argv[2]};
  try {
    const std::vector<semfoam::ManualCommand> commands = semfoam::AllManualCommands();
    WriteTextFile(folder / "man1/semfoam.1", ProgramPage(commands, edition));
    for (const semfoam::ManualCommand& command : commands) {
      WriteTextFile(folder / "man1" / ("semfoam-" + command.description.name + ".1"),
                    CommandPage(command, edition));
    }
    WriteTextFile(folder / "completions/semfoam", BashCompletion(commands));
    WriteTextFile(folder / "completions/_semfoam", ZshCompletion(commands));
    WriteTextFile(folder / "commands.json", CommandsJson(commands));
  } catch (const semfoam::UserError& error) {
    return semfoam::PrintError(error.what());
  }
  return EXIT_SUCCESS;
}
