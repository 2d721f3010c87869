// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/util/parallel.h"
#include "tools/cli/command_description.h"
#include "tools/support/value_text.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

namespace semfoam {

// The options of one command, spelled as COLMAP spells them: `--input_path sparse/0`,
// `--Group.option value`, booleans with a value (0, 1, true, false), `--project_path x.ini` for the
// same options in a file (top keys first, then [Group] sections), -h for the options that people
// use most and --help_all for all. An option on the command line wins over the file's. The group
// may be left out where that is unambiguous: `--num_rays` for `--FoamTraining.num_rays`. Numbers
// may be written as ParseWrittenValue reads them: 300e3, 20M.
//
//   OptionManager options("mesh_exporter", "Writes every object's surface.");
//   options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
//   options.AddDefaultOption("label_id", &label_id, "this object alone; -1 = all");
//   if (!options.Parse(argc, argv)) return;  // help was asked for and given
//
// Options are applied in the order in which they were added, not in the order on the command line.
// So an option that presets others is added before them, and they override it.
class OptionManager {
 public:
  // Adds the options of every command: help, project_path, random_seed (COLMAP 4 spells it
  // default_random_seed; both are accepted), num_threads, log_to_stderr, log_level.
  OptionManager(std::string command, std::string summary);

  // Add an option. T is std::string, bool, int, int64_t, uint64_t, float or double. `*value` before
  // Parse is the default. Names are unique (CHECK).
  template <typename T>
  void AddRequiredOption(const std::string& name, T* value, const std::string& help) {
    Add(name, help, /*required=*/true, {}, value, nullptr);
  }
  template <typename T>
  void AddDefaultOption(const std::string& name, T* value, const std::string& help) {
    Add(name, help, /*required=*/false, {}, value, nullptr);
  }
  // Adds an option in place of which none of the required ones needs to be given: a folder that
  // holds them all.
  void AddStandInOption(const std::string& name, std::string* value, const std::string& help) {
    Add(name, help, /*required=*/false, {}, value, nullptr);
    Find(name)->stands_in = true;
  }
  // Adds an option that must be one of `choices`. `then`, if any, is called with its value, also
  // for the default.
  void AddChoiceOption(const std::string& name,
                       std::string* value,
                       const std::vector<std::string>& choices,
                       const std::string& help,
                       const std::function<void()>& then = nullptr) {
    Add(name, help, /*required=*/false, choices, value, then);
  }

  // Adds the option device, for commands that train or render; Parse calls Device::Find.
  void AddDeviceOption();

  // Adds another spelling of an existing option (CHECK). Both in one place count as the same option
  // given twice.
  void AddShortName(const std::string& short_name, const std::string& name);

  // Sets the options, besides the required ones, that -h lists; --help_all lists the others, too.
  // They must exist (CHECK). Without a call, -h lists all options that the command has added.
  void SetFrequentOptions(const std::vector<std::string>& names);

  // Reads the command line (argv[0] is the command's name and skipped) and the project file that it
  // names, sets all values, and applies the common options: the log and, while this object exists,
  // the number of threads. Returns false after printing help to stdout, if requested, or when
  // called within DescribeCommand. Throws UserError, one sentence in COLMAP's words, on an unknown,
  // ambiguous, missing or repeated option, with the nearest name for a misspelt one, and on a bad
  // value.
  bool Parse(int argc, const char* const* argv);

  // Sets the options that a project file gives, without the effects of the common ones. Throws as
  // Parse does.
  void ReadProject(const std::string& path);
  // Returns the options that the user gave, but for the common ones and those `left_out`, as the
  // text of a project file. Paths in it are absolute.
  std::string ProjectText(const std::set<std::string>& left_out) const;

  // Refuses options that the user gave and that are neither common nor among these: throws
  // UserError, "--quality has no effect " and `why`.
  void RequireOnly(const std::set<std::string>& names, const std::string& why) const;

  // Returns the values of all options of a group, by their names without the group, as text that
  // parses to the same value.
  std::map<std::string, std::string> GroupValues(const std::string& group) const;

  // Returns whether there is such an option.
  bool Has(const std::string& name) const { return Find(name) != nullptr; }

  // Returns whether the user gave this option, on the command line or in the project file.
  bool IsGiven(const std::string& name) const;

  // Refuses options that have no effect in combination with, or without, another one. Throws
  // UserError for the first of these that the user gave a value other than its default: "--frames
  // has no effect " and `why`, which includes what would be right: "without --trajectory; give
  // both, or neither".
  void RequireEffect(const std::vector<std::string>& names, const std::string& why) const;
  // Logs a warning instead, for harmless cases: a command line may be copied from another command.
  void WarnWithoutEffect(const std::vector<std::string>& names, const std::string& why) const;

  // Returns the given command line with this option set to another value, quoted for a shell.
  // `program` comes first.
  std::string CommandLineWith(const std::string& program,
                              const std::string& name,
                              const std::string& value) const;

  // Returns the text of -h, or, with `all`, of --help_all: defaults are those of the present
  // values.
  std::string Help(bool all = false) const;

  CommandDescription Description() const;

  // Returns the seed given by the user; 0 by default.
  uint64_t RandomSeed() const { return random_seed_; }

  // Returns the device of --device, after Parse; the CPU for a command without this option.
  const Device& device() const { return device_; }

 private:
  struct Option {
    std::string name;
    // May be empty.
    std::string short_name;
    std::string help;
    bool required = false;
    // Whether required options may be missing where this one is given.
    bool stands_in = false;
    // Whether every command has it.
    bool is_common = false;
    std::vector<std::string> choices;
    // Returns false for a text that is not a value of the option's type.
    std::function<bool(const std::string&)> parse;
    std::function<std::string()> format;
    // Description of the type: "an integer".
    std::string expected;
    std::function<void()> then;
    std::string default_text;
    bool frequent = true;
    bool given = false;
  };

  template <typename T>
  void Add(const std::string& name,
           const std::string& help,
           bool required,
           const std::vector<std::string>& choices,
           T* value,
           const std::function<void()>& then);
  void AddOption(Option option);
  Option* Find(const std::string& name);
  const Option* Find(const std::string& name) const;
  // Returns whether the user gave this option, which must exist (CHECK), a value other than its
  // default.
  bool IsChosen(const std::string& name) const;
  // Returns the names of the options that `name` spells without their group.
  std::vector<std::string> WithoutGroup(const std::string& name) const;
  // Returns the option's name for any of its spellings; an unknown one unchanged. Throws UserError
  // where it may mean several; `where` begins the sentence.
  std::string FullName(const std::string& where, const std::string& name) const;
  // Returns "; is '--name' meant?" for a misspelt name, "" where none is near.
  std::string Suggestion(const std::string& misspelt) const;
  // Sets the values of the choices given on the command line, for help on them.
  void TakeChoices(const std::map<std::string, std::string>& from_command_line);
  // Finds options whose values another one presets, by trying all choices.
  std::vector<PresetDescription> FindPresets();
  std::map<std::string, std::string> ReadCommandLine(int argc, const char* const* argv) const;
  std::map<std::string, std::string> ReadProjectFile(const std::string& path) const;
  void Apply(const std::map<std::string, std::string>& from_file,
             const std::map<std::string, std::string>& from_command_line,
             const std::string& project_path);

  std::string command_;
  std::string summary_;
  std::vector<Option> options_;
  // Number of options of every command: the first of options_.
  size_t num_general_ = 0;
  // For help.
  std::vector<PresetDescription> presets_;
  // The command line, beginning with the command's name.
  std::vector<std::string> arguments_;
  std::string project_path_;
  uint64_t random_seed_ = 0;
  int num_threads_ = -1;
  std::unique_ptr<const ThreadLimit> thread_limit_;
  // The default, until foam/device/cuda has run on a GPU.
  std::string device_name_ = "cpu";
  Device device_;
  bool log_to_stderr_ = true;
  int log_level_ = 0;
};

template <typename T>
void OptionManager::Add(const std::string& name,
                        const std::string& help,
                        bool required,
                        const std::vector<std::string>& choices,
                        T* value,
                        const std::function<void()>& then) {
  Option option;
  option.name = name;
  option.help = help;
  option.required = required;
  option.choices = choices;
  option.parse = [value](const std::string& text) { return ParseWrittenValue(text, value); };
  option.format = [value] { return FormatValue(*value); };
  option.expected = std::is_same_v<T, bool>       ? "0, 1, true or false"
                    : std::is_unsigned_v<T>       ? "an integer that is not negative"
                    : std::is_integral_v<T>       ? "an integer"
                    : std::is_floating_point_v<T> ? "a number"
                                                  : "a text";
  option.then = then;
  AddOption(std::move(option));
}

}  // namespace semfoam
