// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/suggestion.h"
#include "tools/cli/logging.h"
#include "tools/cli/run_command.h"
#include "tools/commands/commands.h"
#include "tools/images/program_fonts.h"

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace semfoam {
namespace {

void PrintHelp() {
  std::printf("semfoam " SEMFOAM_VERSION
              ": Semantic Foam for COLMAP, from a COLMAP model, photos and instance masks\n"
              "to labelled volumes and meshes.\n\n"
              "Usage:\n"
              "  semfoam automatic_segmenter --workspace_path WORKSPACE --output_path OUTPUT\n"
              "  semfoam COMMAND -h\n"
              "  semfoam COMMAND [options]\n\n"
              "Commands:\n");
  for (const CommandEntry& command : Commands()) {
    std::printf("  %-20s %s\n", command.name, command.summary);
  }
  std::printf("  %-20s %s\n", "help [COMMAND]", "lists the commands, or a command's options");
  std::printf("  %-20s %s\n", "version", "says which version this is");
  std::printf("\nExit codes: %s\n", kExitCodes);
}

int UnknownCommand(const std::string& name) {
  std::vector<std::string> names = {"help", "version"};
  for (const CommandEntry& command : Commands()) names.emplace_back(command.name);
  const std::string nearest = NearestName(name, names);
  return PrintError("Command `" + name + "` not recognized" +
                    (nearest.empty() ? "." : "; is `" + nearest + "` meant?") +
                    " To list the available commands, run `semfoam help`.");
}

int Main(int argc, char** argv) {
  const std::string name = argc < 2 ? "help" : argv[1];
  if (name == "version" || name == "-v" || name == "--version") {
    std::printf("semfoam " SEMFOAM_VERSION "\n");
    return EXIT_SUCCESS;
  }
  if (name == "help" || name == "-h" || name == "--help") {
    if (argc < 3) {
      PrintHelp();
      return EXIT_SUCCESS;
    }
    // `semfoam help COMMAND [options]` is `semfoam COMMAND [options] -h`.
    const CommandEntry* const command = FindCommand(argv[2]);
    if (command == nullptr) return UnknownCommand(argv[2]);
    std::string help = "-h";
    std::vector<char*> arguments(argv + 2, argv + argc);
    arguments.push_back(help.data());
    return RunCommand(command->run, static_cast<int>(arguments.size()), arguments.data());
  }
  const CommandEntry* const command = FindCommand(name);
  if (command == nullptr) return UnknownCommand(name);
  return RunCommand(command->run, argc - 1, argv + 1);
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) {
  semfoam::InitLogging(argv[0]);
  semfoam::UseFontsOfProgram();
  return semfoam::Main(argc, argv);
}
