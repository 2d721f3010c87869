// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace semfoam {

// What a command does and which options it takes, as its OptionManager knows them: for help texts,
// manual pages and completion.
struct OptionDescription {
  // Without dashes: "FoamTraining.num_rays".
  std::string name;
  // Other spellings: "num_rays".
  std::vector<std::string> short_names;
  std::string help;
  // Part of the name before the dot; empty: none.
  std::string group;
  // Empty where any value of the type is taken.
  std::vector<std::string> choices;
  // Description of the type: "an integer".
  std::string expected;
  // Empty: none.
  std::string default_text;
  bool required = false;
  // Whether -h lists it.
  bool frequent = false;
  // Whether every command has it.
  bool general = false;
};

// An option that presets others.
struct PresetDescription {
  std::string name;
  // Its present value.
  std::string value;
  std::vector<std::string> choices;
  // The options that it presets, and [choices][options] their values.
  std::vector<std::string> options;
  std::vector<std::vector<std::string>> values;
};

struct CommandDescription {
  std::string name;
  std::string summary;
  std::vector<OptionDescription> options;
  std::vector<PresetDescription> presets;
};

// Returns what a command tells of itself. `run` makes its OptionManager and calls Parse, as every
// command does first (CHECK); nothing else of it runs.
CommandDescription DescribeCommand(void (*run)(int argc, char** argv), const std::string& name);

}  // namespace semfoam
