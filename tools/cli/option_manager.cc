// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/option_manager.h"

#include "foam/device/device.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/number_text.h"
#include "foam/util/parallel.h"
#include "foam/util/suggestion.h"
#include "tools/cli/logging.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <set>
#include <sstream>

#include <boost/program_options.hpp>
#include <glog/logging.h>

namespace semfoam {
namespace {

namespace po = boost::program_options;

std::string Join(const std::vector<std::string>& parts, const std::string& separator) {
  std::string joined;
  for (const std::string& part : parts) {
    if (!joined.empty()) joined += separator;
    joined += part;
  }
  return joined;
}

std::string Trim(const std::string& text) {
  const char* space = " \t\r";
  const size_t begin = text.find_first_not_of(space);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(space) - begin + 1);
}

// Boost's parser for the command line alone: every option is a text to it. Types, defaults and the
// required are ours, the same for command line and file.
po::options_description Describe(const std::vector<std::string>& names) {
  po::options_description description;
  description.add_options()("help,h", "")("help_all", "");
  for (const std::string& name : names) {
    description.add_options()(name.c_str(), po::value<std::string>(), "");
  }
  return description;
}

// Where Parse puts the description instead of running; null outside of DescribeCommand.
thread_local CommandDescription* requested_description = nullptr;

std::string GroupOf(const std::string& name) {
  const size_t dot = name.find('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

std::string WithoutItsGroup(const std::string& name) {
  const size_t dot = name.find('.');
  return dot == std::string::npos ? name : name.substr(dot + 1);
}

// Adds the line of an option to a list of help.
void Describe(const OptionDescription& option, po::options_description* list) {
  std::string help = option.required ? "(required) " : "";
  if (!option.choices.empty()) help.append("{").append(Join(option.choices, ", ")).append("} ");
  help += option.help;
  for (const std::string& name : option.short_names) {
    help.append("; --").append(name + " is the same");
  }
  auto* value = po::value<std::string>();
  const bool names_default = !option.required && !option.default_text.empty();
  value->value_name(names_default ? "arg (=" + option.default_text + ")" : "arg");
  list->add_options()(option.name.c_str(), value, help.c_str());
}

po::options_description List(const std::string& title) {
  constexpr int kColumns = 100;
  constexpr int kColumnsOfHelp = 40;
  return po::options_description(title, kColumns, kColumnsOfHelp);
}

}  // namespace

CommandDescription DescribeCommand(void (*run)(int argc, char** argv), const std::string& name) {
  CommandDescription description;
  requested_description = &description;
  std::string argument = name;
  char* argv[] = {argument.data(), nullptr};
  run(1, argv);
  CHECK(requested_description == nullptr) << name;
  return description;
}

OptionManager::OptionManager(std::string command, std::string summary)
    : command_(std::move(command)), summary_(std::move(summary)) {
  AddDefaultOption("project_path", &project_path_, "an .ini file that holds options of this list");
  AddDefaultOption("random_seed", &random_seed_, "same seed, input and options: same bytes");
  AddDefaultOption("default_random_seed", &random_seed_, "the same, as COLMAP 4 spells it");
  AddDefaultOption("num_threads", &num_threads_, "-1 = all cores; changes no result");
  AddDefaultOption("log_to_stderr", &log_to_stderr_, "0 = only warnings and errors");
  AddDefaultOption("log_level", &log_level_, "verbosity of the log, as glog's v");
  num_general_ = options_.size();
  for (Option& option : options_) {
    option.is_common = true;
    option.frequent = false;
  }
}

void OptionManager::AddDeviceOption() {
  AddDefaultOption("device",
                   &device_name_,
                   "where rays are cast: cpu, cuda:N (the GPU of that number, from 0), "
                   "or auto, the first GPU that can be used, else cpu");
}

void OptionManager::AddOption(Option option) {
  CHECK(Find(option.name) == nullptr) << option.name;
  option.default_text = option.format();
  options_.push_back(std::move(option));
}

OptionManager::Option* OptionManager::Find(const std::string& name) {
  const auto found = std::find_if(
      options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

const OptionManager::Option* OptionManager::Find(const std::string& name) const {
  return const_cast<OptionManager*>(this)->Find(name);
}

void OptionManager::AddShortName(const std::string& short_name, const std::string& name) {
  CHECK(Find(short_name) == nullptr) << short_name;
  Option* const option = Find(name);
  CHECK(option != nullptr) << name;
  option->short_name = short_name;
}

void OptionManager::SetFrequentOptions(const std::vector<std::string>& names) {
  for (Option& option : options_) option.frequent = option.required;
  for (const std::string& name : names) {
    Option* const option = Find(name);
    CHECK(option != nullptr) << name;
    option->frequent = true;
  }
}

std::vector<std::string> OptionManager::WithoutGroup(const std::string& name) const {
  std::vector<std::string> meant;
  for (const Option& option : options_) {
    if (!GroupOf(option.name).empty() && WithoutItsGroup(option.name) == name) {
      meant.push_back(option.name);
    }
  }
  return meant;
}

std::string OptionManager::FullName(const std::string& where, const std::string& name) const {
  if (name.empty() || Find(name) != nullptr) return name;
  for (const Option& option : options_) {
    if (option.short_name == name) return option.name;
  }
  const std::vector<std::string> meant = WithoutGroup(name);
  if (meant.size() > 1) {
    throw UserError(where,
                    " the option '--",
                    name,
                    "' may mean '--",
                    Join(meant, "' or '--"),
                    "'; give the name with its group.");
  }
  return meant.empty() ? name : meant.front();
}

std::string OptionManager::Suggestion(const std::string& misspelt) const {
  // Names of the command's own options first, and those without groups before those with.
  std::vector<std::string> names = {"help", "help_all"};
  std::map<std::string, std::string> full_names = {{"help", "help"}, {"help_all", "help_all"}};
  for (const Option& option : options_) {
    names.push_back(option.name);
    full_names[option.name] = option.name;
    if (!option.short_name.empty()) {
      names.push_back(option.short_name);
      full_names[option.short_name] = option.name;
    }
  }
  for (const Option& option : options_) {
    if (const std::string name = WithoutItsGroup(option.name); full_names.count(name) == 0) {
      names.push_back(name);
      full_names[name] = option.name;
    }
  }
  const std::string nearest = NearestName(misspelt, names);
  return nearest.empty() ? "" : "; is '--" + full_names[nearest] + "' meant?";
}

bool OptionManager::IsGiven(const std::string& name) const {
  const Option* const option = Find(name);
  return option != nullptr && option->given;
}

bool OptionManager::IsChosen(const std::string& name) const {
  const Option* const option = Find(name);
  CHECK(option != nullptr) << name;
  return option->given && option->format() != option->default_text;
}

void OptionManager::RequireEffect(const std::vector<std::string>& names,
                                  const std::string& why) const {
  for (const std::string& name : names) {
    if (!IsChosen(name)) continue;
    throw UserError("Failed to parse options - --", name, " has no effect ", why, ".");
  }
}

void OptionManager::WarnWithoutEffect(const std::vector<std::string>& names,
                                      const std::string& why) const {
  for (const std::string& name : names) {
    if (IsChosen(name)) LOG(WARNING) << "--" << name << " has no effect " << why << ".";
  }
}

std::map<std::string, std::string> OptionManager::GroupValues(const std::string& group) const {
  std::map<std::string, std::string> values;
  const std::string prefix = group + ".";
  for (const Option& option : options_) {
    if (option.name.compare(0, prefix.size(), prefix) == 0) {
      values[option.name.substr(prefix.size())] = option.format();
    }
  }
  return values;
}

std::map<std::string, std::string> OptionManager::ReadCommandLine(int argc,
                                                                  const char* const* argv) const {
  std::set<std::string> names;
  for (const Option& option : options_) {
    names.insert(option.name);
    names.insert(WithoutItsGroup(option.name));
    if (!option.short_name.empty()) names.insert(option.short_name);
  }
  const po::options_description description = Describe({names.begin(), names.end()});
  // No guessing from a beginning: what begins one option today begins two tomorrow.
  const int style = po::command_line_style::unix_style & ~po::command_line_style::allow_guessing;
  std::map<std::string, std::string> values;
  try {
    const po::parsed_options parsed =
        po::command_line_parser(argc, argv).options(description).style(style).run();
    for (const po::option& option : parsed.options) {
      if (option.position_key != -1) {
        throw UserError("Failed to parse options - '",
                        Shortened(Join(option.value, " ")),
                        "' stands where an option was expected; options are written '--name "
                        "value'.");
      }
      const std::string value = option.value.empty() ? "" : option.value.front();
      // Boost takes the next option for the value of one that came without.
      if (option.original_tokens.size() > 1 && value.compare(0, 2, "--") == 0) {
        throw UserError("Failed to parse options - the required argument for option '--",
                        option.string_key,
                        "' is missing.");
      }
      const std::string name = FullName("Failed to parse options -", option.string_key);
      if (!values.emplace(name, value).second) {
        throw UserError("Failed to parse options - the option '--",
                        option.string_key,
                        "' is given more than once; give it once.");
      }
    }
  } catch (const po::unknown_option& error) {
    std::string name = error.get_option_name();
    name.erase(0, std::min(name.find_first_not_of('-'), name.size()));
    std::string end = Suggestion(name);
    if (end.empty()) end = ".";
    throw UserError("Failed to parse options - unrecognised option '--", Shortened(name), "'", end);
  } catch (const po::error& error) {
    throw UserError("Failed to parse options - ", error.what(), ".");
  }
  return values;
}

std::map<std::string, std::string> OptionManager::ReadProjectFile(const std::string& path) const {
  if (path.empty()) {
    throw UserError(
        "Failed to parse options - the argument ('') for option '--project_path' is invalid; it "
        "takes an .ini file.");
  }
  const std::string bytes = ReadFileBytes(path, "an .ini file for --project_path");
  std::istringstream file{std::string(WithoutByteOrderMark(bytes))};
  std::map<std::string, std::string> values;
  std::string group;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line = Trim(line);
    if (line.empty() || line[0] == '#' || line[0] == ';') continue;
    if (line.front() == '[' && line.back() == ']') {
      group = Trim(line.substr(1, line.size() - 2)) + ".";
      continue;
    }
    const size_t equals = line.find('=');
    if (equals == std::string::npos) {
      throw UserError(path,
                      ": line ",
                      number,
                      " is neither 'option = value' nor '[Group]' nor a comment that begins with "
                      "'#' or ';'.");
    }
    const std::string name = group + Trim(line.substr(0, equals));
    const std::string full_name = FullName(path + ":", name);
    if (!values.emplace(full_name, Trim(line.substr(equals + 1))).second) {
      throw UserError(
          path, ": gives the option '", Shortened(name), "' more than once; give it once.");
    }
  }
  return values;
}

void OptionManager::Apply(const std::map<std::string, std::string>& from_file,
                          const std::map<std::string, std::string>& from_command_line,
                          const std::string& project_path) {
  for (const auto& [name, value] : from_file) {
    if (Find(name) == nullptr || name == "project_path") {
      const std::string meant = Find(name) == nullptr ? Suggestion(name) : "";
      throw UserError(
          project_path,
          ": holds the option '",
          Shortened(name),
          "', which the command ",
          command_,
          " does not have",
          !meant.empty() ? meant : "; `semfoam " + command_ + " --help_all` lists those it has.");
    }
  }
  const bool has_stand_in =
      std::any_of(options_.begin(), options_.end(), [&](const Option& option) {
        return option.stands_in &&
               (from_command_line.count(option.name) != 0 || from_file.count(option.name) != 0);
      });
  for (Option& option : options_) {
    const auto in_line = from_command_line.find(option.name);
    const auto in_file = from_file.find(option.name);
    const bool is_in_line = in_line != from_command_line.end();
    option.given = is_in_line || in_file != from_file.end();
    if (!option.given) {
      if (option.required && !has_stand_in) {
        throw UserError(
            "Failed to parse options - the option '--", option.name, "' is required but missing.");
      }
    } else {
      const std::string& text = is_in_line ? in_line->second : in_file->second;
      const std::string where =
          is_in_line ? "Failed to parse options - the" : project_path + ": the";
      const bool is_choice =
          option.choices.empty() ||
          std::find(option.choices.begin(), option.choices.end(), text) != option.choices.end();
      const bool lacks_value = option.required && text.empty();
      if (!is_choice || lacks_value || !option.parse(text)) {
        throw UserError(where,
                        " argument ('",
                        Shortened(text),
                        "') for option '--",
                        option.name,
                        "' is invalid; it takes ",
                        lacks_value ? "what is not empty"
                        : is_choice ? option.expected
                                    : "{" + Join(option.choices, ", ") + "}",
                        ".");
      }
    }
    if (option.then) option.then();
  }
}

void OptionManager::ReadProject(const std::string& path) { Apply(ReadProjectFile(path), {}, path); }

std::string OptionManager::ProjectText(const std::set<std::string>& left_out) const {
  // Options without a group come first.
  std::map<std::string, std::string> lines_of_group;
  for (const Option& option : options_) {
    const bool is_seed = option.name == "random_seed" || option.name == "default_random_seed";
    if (!option.given || (option.is_common && !is_seed) || left_out.count(option.name) != 0) {
      continue;
    }
    const size_t dot = option.name.find('.');
    const std::string group = dot == std::string::npos ? "" : option.name.substr(0, dot);
    const std::string name = dot == std::string::npos ? option.name : option.name.substr(dot + 1);
    std::string value = option.format();
    if (name.ends_with("_path") && !value.empty()) {
      value = std::filesystem::absolute(value).lexically_normal().string();
    }
    lines_of_group[group] += name + " = " + value + "\n";
  }
  std::string text;
  for (const auto& [group, lines] : lines_of_group) {
    text += (group.empty() ? "" : "[" + group + "]\n") + lines;
  }
  return text;
}

void OptionManager::RequireOnly(const std::set<std::string>& names, const std::string& why) const {
  for (const Option& option : options_) {
    if (!option.given || option.is_common || names.count(option.name) != 0) continue;
    throw UserError("Failed to parse options - --", option.name, " has no effect ", why, ".");
  }
}

std::string OptionManager::CommandLineWith(const std::string& program,
                                           const std::string& name,
                                           const std::string& value) const {
  std::vector<std::string> words = {program};
  for (size_t i = 0; i < arguments_.size(); ++i) {
    if (arguments_[i] == "--" + name) {
      ++i;  // its value
    } else if (arguments_[i].compare(0, name.size() + 3, "--" + name + "=") != 0) {
      words.push_back(arguments_[i]);
    }
  }
  words.insert(words.end(), {"--" + name, value});
  for (std::string& word : words) word = ShellQuoted(word);
  return Join(words, " ");
}

void OptionManager::TakeChoices(const std::map<std::string, std::string>& from_command_line) {
  for (Option& option : options_) {
    const auto given = from_command_line.find(option.name);
    if (option.choices.empty() || given == from_command_line.end()) continue;
    if (std::count(option.choices.begin(), option.choices.end(), given->second) == 0) continue;
    option.parse(given->second);
    if (option.then) option.then();
  }
}

std::vector<PresetDescription> OptionManager::FindPresets() {
  const auto texts = [this] {
    std::vector<std::string> all;
    for (const Option& option : options_) all.push_back(option.format());
    return all;
  };
  std::vector<PresetDescription> presets;
  for (Option& option : options_) {
    if (option.choices.empty() || !option.then) continue;
    PresetDescription preset{option.name, option.format(), option.choices, {}, {}};
    std::vector<std::vector<std::string>> values;
    for (const std::string& choice : option.choices) {
      option.parse(choice);
      option.then();
      values.push_back(texts());
      preset.values.emplace_back();
    }
    option.parse(preset.value);
    option.then();
    for (size_t i = 0; i < options_.size(); ++i) {
      const bool depends = std::any_of(values.begin(), values.end(), [&](const auto& of_choice) {
        return of_choice[i] != values.front()[i];
      });
      if (&options_[i] == &option || !depends) continue;
      preset.options.push_back(options_[i].name);
      for (size_t k = 0; k < values.size(); ++k) preset.values[k].push_back(values[k][i]);
    }
    if (!preset.options.empty()) presets.push_back(std::move(preset));
  }
  return presets;
}

bool OptionManager::Parse(int argc, const char* const* argv) {
  if (requested_description != nullptr) {
    presets_ = FindPresets();
    *requested_description = Description();
    requested_description = nullptr;
    return false;
  }
  arguments_.assign(argv, argv + argc);
  const std::map<std::string, std::string> from_command_line = ReadCommandLine(argc, argv);
  const bool help_all = from_command_line.count("help_all") != 0;
  if (help_all || from_command_line.count("help") != 0) {
    TakeChoices(from_command_line);
    presets_ = FindPresets();
    std::cout << Help(help_all) << std::flush;
    return false;
  }
  std::map<std::string, std::string> from_file;
  std::string project_path;
  if (const auto given = from_command_line.find("project_path"); given != from_command_line.end()) {
    project_path = given->second;
    from_file = ReadProjectFile(project_path);
  }
  Apply(from_file, from_command_line, project_path);

  if (num_threads_ != -1 && num_threads_ < 1) {
    throw UserError("Failed to parse options - the argument ('",
                    num_threads_,
                    "') for option '--num_threads' is invalid; it takes -1 for all cores or a "
                    "number of threads from 1 on.");
  }
  thread_limit_ = std::make_unique<const ThreadLimit>(num_threads_);
  if (Find("device") != nullptr) device_ = Device::Find(device_name_);
  SetLogVerbosity(log_to_stderr_, log_level_);
  return true;
}

CommandDescription OptionManager::Description() const {
  CommandDescription description{command_, summary_, {}, presets_};
  for (size_t i = 0; i < options_.size(); ++i) {
    const Option& option = options_[i];
    OptionDescription described;
    described.name = option.name;
    if (!option.short_name.empty()) described.short_names.push_back(option.short_name);
    described.group = GroupOf(option.name);
    const std::string without = WithoutItsGroup(option.name);
    if (!described.group.empty() && Find(without) == nullptr && WithoutGroup(without).size() == 1) {
      described.short_names.push_back(without);
    }
    described.help = option.help;
    described.choices = option.choices;
    described.expected = option.expected;
    described.default_text = option.format();
    described.required = option.required;
    described.frequent = option.frequent;
    described.general = i < num_general_;
    description.options.push_back(std::move(described));
  }
  return description;
}

std::string OptionManager::Help(bool all) const {
  const CommandDescription description = Description();
  std::ostringstream text;
  text << "semfoam " << command_ << ": " << summary_ << "\n\n";
  po::options_description own = List("Options");
  own.add_options()("help,h", "lists the options that are used most");
  own.add_options()("help_all", "lists all options");
  // Groups in the order of their first options.
  std::vector<std::string> groups;
  std::map<std::string, po::options_description> lists;
  po::options_description general = List("Options of every command");
  size_t num_hidden = 0;
  for (const OptionDescription& option : description.options) {
    if (!all && !option.frequent) {
      ++num_hidden;
    } else if (option.general) {
      Describe(option, &general);
    } else if (!all || option.group.empty()) {
      Describe(option, &own);
    } else {
      const auto [list, is_new] =
          lists.try_emplace(option.group, List("Options of " + option.group));
      if (is_new) groups.push_back(option.group);
      Describe(option, &list->second);
    }
  }
  text << own;
  for (const std::string& group : groups) text << "\n" << lists.at(group);
  if (!general.options().empty()) text << "\n" << general;
  for (const PresetDescription& preset : presets_) {
    text << "\n--" << preset.name << " " << preset.value << " presets:\n";
    for (const std::string& name : preset.options) {
      text << "  --" << name << " " << Find(name)->format() << "\n";
    }
  }
  text << "\n";
  if (num_hidden > 0) {
    text << num_hidden << " more options: semfoam " << command_ << " --help_all\n";
  }
  text
      << "Numbers may be written as 300e3, 1.5k or 20M. Options can either be given on the command "
         "line or in an\n.ini file that --project_path names.\n";
  return text.str();
}

}  // namespace semfoam
