// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/manual/completion.h"

#include <string>

namespace semfoam {
namespace {

std::string Joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : " ") + part;
  return text;
}

// Returns what an option can be given; empty where that is any text, number or path.
std::vector<std::string> Values(const OptionDescription& option) {
  if (!option.choices.empty()) return option.choices;
  if (option.expected.starts_with("0, 1")) return {"0", "1"};
  return {};
}

std::string CommandNames(const std::vector<ManualCommand>& commands) {
  std::string names;
  for (const ManualCommand& command : commands) names += command.description.name + " ";
  return names;
}

// Text within single quotes of zsh, where _arguments and _describe give ':' and '[]' a meaning.
std::string Zsh(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\'') {
      escaped += "'\\''";
    } else {
      if (c == ':' || c == '[' || c == ']' || c == '\\') escaped += '\\';
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace

std::string BashCompletion(const std::vector<ManualCommand>& commands) {
  std::string script = R"(# bash completion for semfoam, generated from its options

# Prints the options of a command.
_semfoam_options() {
  case $1 in
)";
  for (const ManualCommand& command : commands) {
    std::vector<std::string> options = {"--help", "--help_all"};
    for (const OptionDescription& option : command.description.options) {
      options.push_back("--" + option.name);
    }
    script += "    " + command.description.name + ") echo " + Joined(options) + " ;;\n";
  }
  script += R"(  esac
}

# Prints the values of an option of a command, if it has a few.
_semfoam_values() {
  case $1$2 in
)";
  for (const ManualCommand& command : commands) {
    for (const OptionDescription& option : command.description.options) {
      const std::vector<std::string> values = Values(option);
      if (values.empty()) continue;
      std::string patterns = command.description.name + "--" + option.name;
      for (const std::string& name : option.short_names) {
        patterns += " | " + command.description.name + "--" + name;
      }
      script += "    " + patterns + ") echo " + Joined(values) + " ;;\n";
    }
  }
  script += R"(  esac
}

_semfoam() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local command=${COMP_WORDS[1]} words
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    words=")" +
            CommandNames(commands) + R"(help version"
  elif [[ $command == help ]]; then
    ((COMP_CWORD == 2)) || return 0
    words=")" +
            CommandNames(commands) + R"("
  else
    # bash takes "--option=value" apart at the sign.
    if [[ $current == "=" ]]; then
      current=
    elif [[ $previous == "=" ]]; then
      previous=${COMP_WORDS[COMP_CWORD - 2]}
    fi
    if [[ $previous == --* && $previous != --help && $previous != --help_all ]]; then
      # Without a reply, files are completed (-o default).
      words=$(_semfoam_values "$command" "$previous")
    else
      words=$(_semfoam_options "$command")
    fi
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}

complete -o default -F _semfoam semfoam
)";
  return script;
}

std::string ZshCompletion(const std::vector<ManualCommand>& commands) {
  std::string script =
      "#compdef semfoam\n# zsh completion for semfoam, generated from its options\n\n"
      "_semfoam() {\n  local -a commands\n  commands=(\n";
  for (const ManualCommand& command : commands) {
    script += "    '" + command.description.name + ":" + Zsh(command.brief) + "'\n";
  }
  script += R"(    'help:lists the commands, or the options of one'
    'version:says which version this is'
  )
  if ((CURRENT == 2)) || [[ $words[2] == help && CURRENT -eq 3 ]]; then
    _describe command commands
    return
  fi
  local command=$words[2]
  shift words
  ((CURRENT--))
  case $command in
)";
  for (const ManualCommand& command : commands) {
    script += "    " + command.description.name + ")\n      _arguments \\\n";
    script += "        '(- *)'{-h,--help}'[lists the options that are used most]' \\\n";
    script += "        '(- *)--help_all[lists all options]'";
    for (const OptionDescription& option : command.description.options) {
      script +=
          " \\\n        '--" + option.name + "[" + Zsh(option.help) + "]:" + option.name + ":";
      const std::vector<std::string> values = Values(option);
      if (!values.empty()) {
        script.append("(").append(Joined(values)).append(")");
      } else if (option.name.ends_with("_path")) {
        script += "_files";
      } else {
        script += " ";
      }
      script += "'";
    }
    script += "\n      ;;\n";
  }
  return script + "  esac\n}\n\n_semfoam \"$@\"\n";
}

}  // namespace semfoam
