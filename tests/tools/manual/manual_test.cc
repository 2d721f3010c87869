// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/manual/completion.h"
#include "tools/manual/manual_pages.h"

#include <cstdlib>
#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// The manual pages and completions that the build has made of the options.
namespace semfoam {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;

const std::filesystem::path kManual = SEMFOAM_MANUAL;

bool IsInstalled(const std::string& program) {
  return RunProgram("sh", {"-c", "command -v " + program}).exit_code == 0;
}

std::string Page(const std::string& name) {
  const Outcome unpacked = RunProgram("gzip", {"-dc", (kManual / "man1" / name).string()});
  EXPECT_EQ(unpacked.exit_code, 0) << name;
  return unpacked.out;
}

TEST(Manual, EveryCommandHasAPageWithAllItsOptions) {
  std::vector<std::string> expected = {"semfoam.1.gz"};
  const std::string index = Page("semfoam.1.gz");
  for (const ManualCommand& command : AllManualCommands()) {
    const std::string name = "semfoam-" + command.description.name;
    expected.push_back(name + ".1.gz");
    EXPECT_THAT(index, HasSubstr("semfoam\\-" + command.description.name + " (1)"));
    const std::string page = Page(name + ".1.gz");
    for (const char* section :
         {".SH NAME\n", ".SH SYNOPSIS\n", ".SH OPTIONS\n", ".SH EXIT STATUS\n"}) {
      EXPECT_THAT(page, HasSubstr(section)) << name;
    }
    for (const OptionDescription& option : command.description.options) {
      EXPECT_THAT(page, HasSubstr("\n\\fB\\-\\-" + option.name + "\\fR \\fI")) << name;
    }
    // Pages hold what roff takes for text everywhere: nothing but ASCII, no line that begins a
    // request by accident.
    for (const char c : page) EXPECT_TRUE((c >= ' ' && c <= '~') || c == '\n') << name;
    std::istringstream lines(page);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with('.') && !line.starts_with('\'')) continue;
      const std::string request = line.substr(1, line.find(' ') - 1);
      EXPECT_THAT(
          (std::vector<std::string>{
              "TH", "SH", "SS", "TP", "PP", "B", "I", "BR", "RI", "RS", "RE", "nf", "fi", "br"}),
          Contains(request))
          << name << ": " << line;
    }
  }
  EXPECT_THAT(FilesBelow(kManual / "man1"), testing::UnorderedElementsAreArray(expected));
  EXPECT_THAT(Page("semfoam-foam_trainer.1.gz"),
              HasSubstr("\\-\\-FoamTraining.num_rays 190000000"));
}

// As far as the checkers are installed.
TEST(Manual, NoCheckerOfPagesFindsAnything) {
  for (const std::string& page : FilesBelow(kManual / "man1")) {
    const std::string path = (kManual / "man1" / page).string();
    if (IsInstalled("groff")) {
      const Outcome groff = RunProgram(
          "sh", {"-c", "gzip -dc \"$0\" | groff -man -Tutf8 -ww -z -rCHECKSTYLE=3", path});
      EXPECT_EQ(groff.exit_code, 0) << page;
      EXPECT_EQ(groff.err + groff.out, "") << page;
    }
    if (IsInstalled("mandoc")) {
      const Outcome mandoc = RunProgram("mandoc", {"-Tlint", "-W", "style", path});
      EXPECT_EQ(mandoc.exit_code, 0) << page << mandoc.out;
      EXPECT_EQ(mandoc.out + mandoc.err, "") << page;
    }
  }
}

// The words that bash offers for the last of these words.
std::vector<std::string> Completed(const std::vector<std::string>& words) {
  std::string script =
      "source " + Quoted((kManual / "completions/semfoam").string()) + "; COMP_WORDS=(";
  for (const std::string& word : words) script += Quoted(word) + " ";
  script += "); COMP_CWORD=" + std::to_string(words.size() - 1) +
            "; _semfoam; printf '%s\\n' \"${COMPREPLY[@]}\"";
  const Outcome outcome = RunProgram("bash", {"-c", script});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  std::vector<std::string> offered;
  std::istringstream lines(outcome.out);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) offered.push_back(line);
  }
  return offered;
}

TEST(Manual, BashCompletesCommandsOptionsAndValues) {
  EXPECT_THAT(Completed({"semfoam", "foam_t"}), ElementsAre("foam_trainer"));
  EXPECT_EQ(Completed({"semfoam", ""}).size(), AllManualCommands().size() + 2);
  EXPECT_THAT(Completed({"semfoam", "help", "mesh_"}),
              ElementsAre("mesh_exporter", "mesh_evaluator"));
  EXPECT_THAT(Completed({"semfoam", "help", "foam_trainer", ""}), IsEmpty());
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--q"}), ElementsAre("--quality"));
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--image_path", "a", ""}),
              IsSupersetOf({"--FoamTraining.num_rays", "--help_all", "--num_threads"}));
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--quality", ""}),
              ElementsAre("low", "medium", "high", "extreme"));
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--quality", "m"}), ElementsAre("medium"));
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--quality", "=", "hi"}), ElementsAre("high"));
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--quality", "="}),
              ElementsAre("low", "medium", "high", "extreme"));
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--overwrite", ""}), ElementsAre("0", "1"));
  EXPECT_THAT(Completed({"semfoam", "mesh_exporter", "--method", "s"}), ElementsAre("smooth"));
  // Left to bash, which offers files.
  EXPECT_THAT(Completed({"semfoam", "foam_trainer", "--image_path", "x"}), IsEmpty());
  EXPECT_THAT(Completed({"semfoam", "no_command", "--"}), IsEmpty());
}

// zsh parses it, if it is installed.
TEST(Manual, ZshCompletionIsZshAndNamesAllOptions) {
  const std::string script = ReadFile(kManual / "completions/_semfoam");
  EXPECT_TRUE(script.starts_with("#compdef semfoam\n"));
  for (const ManualCommand& command : AllManualCommands()) {
    EXPECT_THAT(script, HasSubstr("\n    " + command.description.name + ")\n"));
    for (const OptionDescription& option : command.description.options) {
      EXPECT_THAT(script, HasSubstr("'--" + option.name + "["));
    }
  }
  if (!IsInstalled("zsh")) return;
  EXPECT_EQ(RunProgram("zsh", {"-n", (kManual / "completions/_semfoam").string()}).exit_code, 0);
}

TEST(Manual, TellsTheSameAsJson) {
  const nlohmann::json commands = nlohmann::json::parse(ReadFile(kManual / "commands.json"));
  EXPECT_EQ(commands, nlohmann::json::parse(CommandsJson(AllManualCommands())));
  EXPECT_EQ(commands[2]["name"], "foam_trainer");
  EXPECT_THAT(commands[2]["presets"][0]["options"], Contains("FoamTraining.num_rays"));
  EXPECT_EQ(commands[2]["presets"][0]["values"][0][0], "12000000");
}

}  // namespace
}  // namespace semfoam
