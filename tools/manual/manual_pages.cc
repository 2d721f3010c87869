// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/manual/manual_pages.h"

#include "tools/cli/run_command.h"
#include "tools/commands/commands.h"

#include <algorithm>
#include <sstream>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

// Returns a word or a few for a line of a page: roff's own characters are escaped.
std::string Roff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

// Returns lines of text of a page, of at most 80 bytes as far as words allow; a sentence begins a
// line, as troff wants it to set the space between sentences.
std::string RoffLines(const std::string& text) {
  constexpr size_t kLongestLine = 80;
  std::string lines;
  std::string line;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    word = Roff(word);
    if (!line.empty() && (line.size() + 1 + word.size() > kLongestLine || line.ends_with('.'))) {
      lines += line + "\n";
      line.clear();
    }
    if (!line.empty()) {
      line += " " + word;
    } else {
      // A point or an apostrophe would begin a request.
      if (word[0] == '.' || word[0] == '\'') line += "\\&";
      line += word;
    }
  }
  return lines + line + "\n";
}

std::string Capitalized(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] += 'A' - 'a';
  return text;
}

std::string Sentence(std::string text) {
  text = Capitalized(std::move(text));
  if (text.back() != '.') text += '.';
  return text;
}

std::string Joined(const std::vector<std::string>& parts, const std::string& between) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : between) + part;
  return text;
}

std::string Head(const std::string& page, const ManualEdition& edition) {
  std::string title = page;
  for (char& c : title) {
    if (c >= 'a' && c <= 'z') c += 'A' - 'a';
  }
  return ".TH \"" + Roff(title) + "\" 1 " + edition.date + " \"semfoam " + edition.version +
         "\" \"Semantic Foam for COLMAP\"\n";
}

// A name for the option's value in the synopsis: FOLDER for a path, N for a number.
std::string ValueName(const OptionDescription& option) {
  if (!option.choices.empty()) return Joined(option.choices, "|");
  if (option.name.ends_with("_path")) return "PATH";
  if (option.expected.starts_with("0, 1")) return "0|1";
  if (option.expected.starts_with("an integer")) return "N";
  if (option.expected == "a number") return "X";
  return "TEXT";
}

std::string OptionEntry(const OptionDescription& option) {
  std::string entry =
      ".TP\n\\fB" + Roff("--" + option.name) + "\\fR \\fI" + Roff(ValueName(option)) + "\\fR";
  for (const std::string& name : option.short_names) entry += ", \\fB" + Roff("--" + name) + "\\fR";
  entry += "\n" + RoffLines(Sentence(option.help));
  if (option.required) {
    entry += "Required.\n";
  } else if (!option.default_text.empty()) {
    entry += RoffLines("Default: " + option.default_text + ".");
  }
  return entry;
}

std::string PresetTable(const PresetDescription& preset) {
  std::string text = ".SS " + Roff("What --" + preset.name + " presets") +
                     "\nWhat is given by name overrides it.\n";
  for (size_t k = 0; k < preset.choices.size(); ++k) {
    text += ".TP\n\\fB" + Roff("--" + preset.name + " " + preset.choices[k]) + "\\fR\n";
    std::vector<std::string> values;
    for (size_t i = 0; i < preset.options.size(); ++i) {
      values.push_back("--" + preset.options[i] + " " + preset.values[k][i]);
    }
    text += RoffLines(Joined(values, ", "));
  }
  return text;
}

// Exit codes and how options are written, the same for all commands.
std::string CommonSections() {
  return ".SH NOTES\n" +
         RoffLines(
             "Options have a value each, also 0 or 1. A group, the part of a name before the dot, "
             "may be left out where one option alone can be meant. Numbers may be written as "
             "300e3, 1.5k or 20M. The options may stand in an .ini file, which --project_path "
             "names: first \"option = value\" lines, then those of groups, below \"[Group]\". What "
             "is on the command line overrides the file.") +
         ".SH EXIT STATUS\n" + RoffLines(Sentence(kExitCodes));
}

}  // namespace

std::vector<ManualCommand> AllManualCommands() {
  std::vector<ManualCommand> commands;
  for (const CommandEntry& command : Commands()) {
    commands.push_back({command.summary, DescribeCommand(command.run, command.name)});
  }
  return commands;
}

std::string ProgramPage(const std::vector<ManualCommand>& commands, const ManualEdition& edition) {
  std::string page = Head("semfoam", edition);
  page += ".SH NAME\nsemfoam \\- labelled volumes and meshes of COLMAP models, photos and masks\n";
  page +=
      ".SH SYNOPSIS\n.B semfoam\n.I COMMAND\n.RI [ options ]\n.br\n.B semfoam help\n"
      ".RI [ COMMAND ]\n.br\n.B semfoam version\n";
  page += ".SH DESCRIPTION\n" +
          RoffLines(
              "semfoam turns a COLMAP model, its photos and instance masks into a foam, a Voronoi "
              "partition of space whose cells carry density, colour and identity, and writes every "
              "object as a labelled OpenVDB volume and a closed OpenMesh surface, as glTF and as "
              "USD.") +
          ".PP\nThe usual way, from a workspace with images/, sparse/ and object_mask/:\n.PP\n"
          ".RS\n.nf\n" +
          Roff("semfoam automatic_segmenter --workspace_path W --output_path OUT --test_every 8") +
          "\n.fi\n.RE\n.SH COMMANDS\n";
  for (const ManualCommand& command : commands) {
    page += ".TP\n.BR " + Roff("semfoam-" + command.description.name) + " (1)\n" +
            RoffLines(Sentence(command.brief));
  }
  page += CommonSections();
  std::string also = ".SH SEE ALSO\n";
  for (const ManualCommand& command : commands) {
    also += ".BR " + Roff("semfoam-" + command.description.name) + " (1),\n";
  }
  return page + also + ".BR colmap (1)\n";
}

std::string CommandPage(const ManualCommand& command, const ManualEdition& edition) {
  const CommandDescription& description = command.description;
  std::string page = Head("semfoam-" + description.name, edition);
  page += ".SH NAME\n" + RoffLines("semfoam-" + description.name + " - " + command.brief);
  page += ".SH SYNOPSIS\n.B semfoam " + description.name + "\n";
  for (const OptionDescription& option : description.options) {
    if (!option.required) continue;
    page += "\\fB" + Roff("--" + option.name) + "\\fR \\fI" + Roff(ValueName(option)) + "\\fR\n";
  }
  page += ".RI [ options ]\n";
  page += ".SH DESCRIPTION\n" + RoffLines(Sentence(description.summary));
  page += ".SH OPTIONS\n";
  std::vector<std::string> groups;
  for (const OptionDescription& option : description.options) {
    if (option.general) continue;
    if (option.group.empty()) {
      page += OptionEntry(option);
    } else if (std::count(groups.begin(), groups.end(), option.group) == 0) {
      groups.push_back(option.group);
    }
  }
  for (const std::string& group : groups) {
    page += ".SS Options of " + Roff(group) + "\n";
    for (const OptionDescription& option : description.options) {
      if (option.group == group) page += OptionEntry(option);
    }
  }
  page += ".SS Options of every command\n";
  page += ".TP\n\\fB\\-h\\fR, \\fB\\-\\-help\\fR\nLists the options that are used most.\n";
  page += ".TP\n\\fB\\-\\-help_all\\fR\nLists all options.\n";
  for (const OptionDescription& option : description.options) {
    if (option.general) page += OptionEntry(option);
  }
  for (const PresetDescription& preset : description.presets) page += PresetTable(preset);
  return page + CommonSections() + ".SH SEE ALSO\n.BR semfoam (1)\n";
}

std::string CommandsJson(const std::vector<ManualCommand>& commands) {
  ordered_json json = ordered_json::array();
  for (const ManualCommand& command : commands) {
    const CommandDescription& description = command.description;
    ordered_json options = ordered_json::array();
    for (const OptionDescription& option : description.options) {
      options.push_back({{"name", option.name},
                         {"short_names", option.short_names},
                         {"help", option.help},
                         {"group", option.group},
                         {"choices", option.choices},
                         {"expected", option.expected},
                         {"default", option.default_text},
                         {"required", option.required},
                         {"frequent", option.frequent},
                         {"general", option.general}});
    }
    ordered_json presets = ordered_json::array();
    for (const PresetDescription& preset : description.presets) {
      presets.push_back({{"name", preset.name},
                         {"choices", preset.choices},
                         {"options", preset.options},
                         {"values", preset.values}});
    }
    json.push_back({{"name", description.name},
                    {"brief", command.brief},
                    {"summary", description.summary},
                    {"options", options},
                    {"presets", presets}});
  }
  return json.dump(1) + "\n";
}

}  // namespace semfoam
