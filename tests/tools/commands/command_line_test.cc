// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "tools/cli/command_description.h"
#include "tools/commands/commands.h"

#include <regex>
#include <set>

#include "tests/export/test_foams.h"
#include "tests/temp_folder.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// The command line as a whole: what the commands tell of themselves, names, help, tables as JSON.
namespace semfoam {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(CommandLine, EveryCommandShowsADozenOptionsAndTellsOfAll) {
  for (const CommandEntry& command : Commands()) {
    const CommandDescription description = DescribeCommand(command.run, command.name);
    EXPECT_EQ(description.name, command.name);
    EXPECT_FALSE(description.summary.empty()) << command.name;
    int frequent = 0;
    std::set<std::string> spellings;
    for (const OptionDescription& option : description.options) {
      frequent += option.frequent;
      EXPECT_TRUE(option.frequent || !option.required) << option.name;
      EXPECT_FALSE(option.help.empty()) << option.name;
      EXPECT_TRUE(spellings.insert(option.name).second) << option.name;
      for (const std::string& name : option.short_names) {
        EXPECT_TRUE(spellings.insert(name).second) << command.name << " " << name;
      }
    }
    EXPECT_LE(frequent, 15) << command.name;
    const Outcome all = RunSemfoam({command.name, "--help_all"});
    EXPECT_EQ(all.exit_code, 0);
    for (const OptionDescription& option : description.options) {
      EXPECT_THAT(all.out, HasSubstr("--" + option.name + " arg")) << command.name;
    }
  }
}

TEST(CommandLine, HelpOnACommandIsItsOwnHelp) {
  for (const CommandEntry& command : Commands()) {
    const Outcome help = RunSemfoam({"help", command.name});
    EXPECT_EQ(help.exit_code, 0) << help.err;
    EXPECT_EQ(help.out, RunSemfoam({command.name, "-h"}).out);
  }
  EXPECT_THAT(RunSemfoam({"help", "foam_trainer", "--quality", "high"}).out,
              HasSubstr("--quality high presets:\n  --FoamTraining.num_rays 190000000\n"));
  EXPECT_THAT(RunSemfoam({"foam_trainer", "-h"}).out,
              HasSubstr("--quality medium presets:\n  --FoamTraining.num_rays 72000000\n"));
  EXPECT_THAT(RunSemfoam({"help"}).out, HasSubstr("130 for Ctrl-C"));
}

TEST(CommandLine, TellsWhatAMisspeltCommandMayMean) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> misspelt = {
      {{"automatic_segmentor"}, "automatic_segmenter"},
      {{"foam_train"}, "foam_trainer"},
      {{"Foam-Renderer", "--views", "all"}, "foam_renderer"},
      {{"help", "foam_rendrer"}, "foam_renderer"},
      {{"hlep"}, "help"},
  };
  for (const auto& [arguments, meant] : misspelt) {
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.Errors(), ElementsAre(HasSubstr("; is `" + meant + "` meant?")));
  }
  EXPECT_THAT(RunSemfoam({"automatic_segmenter", "--worskpace_path", "W"}).Errors(),
              ElementsAre(HasSubstr("'--worskpace_path'; is '--workspace_path' meant?")));
}

// Tables as JSON hold what the tables show.
TEST(CommandLine, TablesAreJsonOnRequest) {
  const TempFolder folder;
  const std::string foam = (folder / "a.foam").string();
  WriteModel(foam, TouchingBalls(2000));
  const Outcome table = RunSemfoam({"foam_analyzer", "--foam_path", foam});
  ASSERT_EQ(table.exit_code, 0) << table.err;
  const Outcome outcome = RunSemfoam({"foam_analyzer", "--foam_path", foam, "--json", "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["sites"], ReadModel(foam).foam.NumSites());
  ASSERT_FALSE(report["objects"].empty());
  for (const json& object : report["objects"]) {
    const std::string row = std::to_string(object["id"].get<int>()) + "  " +
                            object["name"].get<std::string>() + " +" +
                            std::to_string(object["cells"].get<int>()) + " +" +
                            std::to_string(object["components"].get<int>());
    EXPECT_TRUE(std::regex_search(table.out, std::regex(row))) << row << "\n" << table.out;
  }

  const Outcome labeler = RunSemfoam({"point_labeler",
                                      "--workspace_path",
                                      kTabletop.string(),
                                      "--output_path",
                                      (folder / "points").string(),
                                      "--json",
                                      "1"});
  ASSERT_EQ(labeler.exit_code, 0) << labeler.err;
  int64_t points = 0;
  const json labels = json::parse(labeler.out);
  for (const json& label : labels["labels"]) points += label["points"].get<int64_t>();
  EXPECT_EQ(points + labels["unlabelled_points"].get<int64_t>(), 5621);

  const Outcome analyzer = RunSemfoam({"scene_analyzer",
                                       "--image_path",
                                       (kTabletop / "images").string(),
                                       "--input_path",
                                       (kTabletop / "sparse/0").string(),
                                       "--output_path",
                                       (folder / "effects").string(),
                                       "--json",
                                       "1"});
  ASSERT_EQ(analyzer.exit_code, 0) << analyzer.err;
  EXPECT_EQ(analyzer.out, ReadFile(folder / "effects/effects.json"));
}

TEST(CommandLine, ProgressComesInTheStyleThatIsAskedFor) {
  const TempFolder folder;
  const auto train = [&](const std::string& style) {
    return RunSemfoam(TinyTraining(
        TrainerOn(kTabletop,
                  folder / style,
                  {"--progress", style, "--test_every", "8", "--FoamTraining.num_rays", "60e3"})));
  };
  const Outcome as_json = train("json");
  ASSERT_EQ(as_json.exit_code, 0) << as_json.err;
  json last;
  std::istringstream lines(as_json.err);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('{')) last = json::parse(line);
  }
  EXPECT_EQ(last["task"], "training");
  EXPECT_EQ(last["share"], 1);
  EXPECT_GT(last["held_out_psnr"], 5);
  const Outcome as_bar = train("bar");
  EXPECT_THAT(as_bar.err,
              HasSubstr("\r[############################] 100 %, 0:00 left, held-out "));
  const Outcome as_lines = train("lines");
  EXPECT_THAT(as_lines.err, testing::Not(HasSubstr("\r")));
  EXPECT_THAT(as_lines.err, HasSubstr("iteration "));
  // Nothing of it is in the foam.
  EXPECT_EQ(ReadFile(folder / "json/scene.foam"), ReadFile(folder / "bar/scene.foam"));
}

}  // namespace
}  // namespace semfoam
