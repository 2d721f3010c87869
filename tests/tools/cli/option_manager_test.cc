// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/option_manager.h"

#include "foam/device/device.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "tools/controllers/presets.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// A command with one option of every kind.
struct Command {
  std::string input_path, labels_path;
  std::string quality = "medium";
  bool preview = false;
  int test_every = 0;
  int64_t num_rays = 100;
  float step = 0.25f;
  double voxel_size = 0.1;
  OptionManager options{"foam_trainer", "Trains."};

  Command() {
    options.AddRequiredOption("input_path", &input_path, "the model");
    options.AddChoiceOption("quality", &quality, {"low", "medium"}, "the preset", [this] {
      num_rays = quality == "low" ? 10 : 100;
    });
    options.AddDefaultOption("labels_path", &labels_path, "names; empty = none");
    options.AddDefaultOption("preview", &preview, "pictures too");
    options.AddDefaultOption("test_every", &test_every, "0 = none");
    options.AddDefaultOption("FoamTraining.num_rays", &num_rays, "rays in all");
    options.AddDefaultOption("FoamTraining.step", &step, "a float");
    options.AddDefaultOption("voxel_size", &voxel_size, "a double");
    options.AddDeviceOption();
  }

  bool Parse(std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "foam_trainer");
    return options.Parse(static_cast<int>(arguments.size()), arguments.data());
  }

  // The sentence that Parse throws, or "" where it throws none.
  std::string Error(std::vector<const char*> arguments) {
    try {
      Parse(std::move(arguments));
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
};

std::string WriteProject(const std::string& text) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "project.ini").string();
  std::ofstream(path) << text;
  return path;
}

TEST(OptionManager, ReadsEveryType) {
  Command command;
  EXPECT_TRUE(command.Parse({"--input_path",
                             "a b",
                             "--preview",
                             "1",
                             "--test_every",
                             "-3",
                             "--FoamTraining.num_rays=5000000000",
                             "--FoamTraining.step",
                             "0.1",
                             "--voxel_size",
                             "1e-3"}));
  EXPECT_EQ(command.input_path, "a b");
  EXPECT_TRUE(command.preview);
  EXPECT_EQ(command.test_every, -3);
  EXPECT_EQ(command.num_rays, 5'000'000'000);
  EXPECT_EQ(command.step, 0.1f);
  EXPECT_EQ(command.voxel_size, 1e-3);
}

TEST(OptionManager, KeepsDefaultsAndTellsThemFromWhatWasGiven) {
  Command command;
  EXPECT_TRUE(command.Parse({"--input_path", "a", "--test_every", "0"}));
  EXPECT_EQ(command.test_every, 0);
  EXPECT_EQ(command.voxel_size, 0.1);
  EXPECT_TRUE(command.options.IsGiven("test_every"));
  EXPECT_FALSE(command.options.IsGiven("voxel_size"));
}

TEST(OptionManager, BooleansTakeAValueNeverNone) {
  for (const char* yes : {"1", "true"}) {
    Command command;
    EXPECT_TRUE(command.Parse({"--input_path", "a", "--preview", yes}));
    EXPECT_TRUE(command.preview);
  }
  for (const char* no : {"0", "false"}) {
    Command command;
    command.preview = true;
    EXPECT_TRUE(command.Parse({"--input_path", "a", "--preview", no}));
    EXPECT_FALSE(command.preview);
  }
  EXPECT_THAT(Command().Error({"--input_path", "a", "--preview"}), HasSubstr("'--preview'"));
  EXPECT_THAT(Command().Error({"--preview", "--input_path", "a"}), HasSubstr("'--preview'"));
  EXPECT_EQ(Command().Error({"--input_path", "a", "--preview", "yes"}),
            "Failed to parse options - the argument ('yes') for option '--preview' is invalid; it "
            "takes 0, 1, true or false.");
}

TEST(OptionManager, SaysWhatIsWrongInColmapsWords) {
  EXPECT_EQ(Command().Error({}),
            "Failed to parse options - the option '--input_path' is required but missing.");
  EXPECT_EQ(Command().Error({"--input_path", "a", "--no_such", "1"}),
            "Failed to parse options - unrecognised option '--no_such'.");
  // No guessing from a prefix, but a word about what may be meant.
  EXPECT_EQ(Command().Error({"--input_path", "a", "--test", "1"}),
            "Failed to parse options - unrecognised option '--test'; is '--test_every' meant?");
  EXPECT_THAT(Command().Error({"--input_path", "a", "--input_path", "b"}),
              HasSubstr("'--input_path' is given more than once"));
  EXPECT_THAT(Command().Error({"--input_path", "a", "stray"}), HasSubstr("'stray'"));
  EXPECT_THAT(Command().Error({"--input_path", "a", "--quality", "best"}),
              HasSubstr("it takes {low, medium}."));
}

TEST(OptionManager, RefusesNumbersThatAreNone) {
  const std::pair<const char*, const char*> bad[] = {
      {"--test_every", "eight"},
      {"--test_every", "8x"},
      {"--test_every", "8.5"},
      {"--test_every", "1.2345k"},
      {"--test_every", "1e-3"},
      {"--test_every", "3G"},
      {"--test_every", "1e3k"},
      {"--test_every", "k"},
      {"--test_every", "1 k"},
      {"--test_every", "1e99999999999"},
      {"--voxel_size", "1m"},
      {"--random_seed", "-1k"},
      {"--test_every", ""},
      {"--test_every", " 8"},
      {"--test_every", "99999999999"},
      {"--voxel_size", "nan"},
      {"--voxel_size", "inf"},
      {"--voxel_size", "1e999"},
      {"--voxel_size", "1,5"},
      {"--random_seed", "-1"},
      {"--num_threads", "0"},
      {"--num_threads", "-2"},
  };
  for (const auto& [name, value] : bad) {
    const std::string error = Command().Error({"--input_path", "a", name, value});
    EXPECT_THAT(error, HasSubstr("argument ('" + std::string(value) + "') for option '" + name))
        << name << " " << value;
  }
}

TEST(OptionManager, BothSpellingsOfTheSeed) {
  Command first;
  EXPECT_TRUE(first.Parse({"--input_path", "a", "--random_seed", "18446744073709551615"}));
  EXPECT_EQ(first.options.RandomSeed(), std::numeric_limits<uint64_t>::max());
  Command second;
  EXPECT_TRUE(second.Parse({"--input_path", "a", "--default_random_seed", "7"}));
  EXPECT_EQ(second.options.RandomSeed(), 7u);
}

TEST(OptionManager, LimitsTheThreadsWhileItLives) {
  Command one;
  EXPECT_TRUE(one.Parse({"--input_path", "a", "--num_threads", "1"}));
  EXPECT_EQ(NumThreads(), 1);
}

TEST(OptionManager, FindsTheDevice) {
  Command cpu;
  EXPECT_TRUE(cpu.Parse({"--input_path", "a", "--device", "cpu"}));
  EXPECT_EQ(cpu.options.device().gpu(), std::nullopt);
  Command by_default;
  EXPECT_TRUE(by_default.Parse({"--input_path", "a"}));
  EXPECT_EQ(by_default.options.device().gpu(), std::nullopt);
  for (const char* bad : {"gpu", "cuda", "cuda:", "", "2"}) {
    EXPECT_THAT(Command().Error({"--input_path", "a", "--device", bad}),
                StartsWith("device is '" + std::string(bad) + "'"));
  }
  // No machine has as many GPUs: none at all is the other reason.
  EXPECT_THAT(Command().Error({"--input_path", "a", "--device", "cuda:1000"}),
              StartsWith("device is cuda:1000,"));
  OptionManager exporter("mesh_exporter", "Exports.");
  const char* arguments[] = {"mesh_exporter", "--device", "cpu"};
  EXPECT_THROW(exporter.Parse(3, arguments), UserError);
}

TEST(OptionManager, ExplicitOptionsWinOverThePresetInAnyOrder) {
  Command preset;
  EXPECT_TRUE(preset.Parse({"--input_path", "a", "--quality", "low"}));
  EXPECT_EQ(preset.num_rays, 10);
  Command after;
  EXPECT_TRUE(
      after.Parse({"--input_path", "a", "--quality", "low", "--FoamTraining.num_rays", "3"}));
  EXPECT_EQ(after.num_rays, 3);
  Command before;
  EXPECT_TRUE(
      before.Parse({"--FoamTraining.num_rays", "3", "--quality", "low", "--input_path", "a"}));
  EXPECT_EQ(before.num_rays, 3);
}

TEST(OptionManager, ReadsAProjectFileAndTheCommandLineWins) {
  const std::string project = WriteProject(
      "# a comment\n; another\n\ninput_path = some folder/with spaces\r\ntest_every=4\n"
      "[FoamTraining]\nnum_rays = 77\n");
  Command command;
  EXPECT_TRUE(command.Parse({"--project_path", project.c_str(), "--test_every", "8"}));
  EXPECT_EQ(command.input_path, "some folder/with spaces");
  EXPECT_EQ(command.test_every, 8);
  EXPECT_EQ(command.num_rays, 77);
  EXPECT_TRUE(command.options.IsGiven("FoamTraining.num_rays"));
}

TEST(OptionManager, NamesTheProjectFileAndWhatIsWrongInIt) {
  const std::pair<const char*, const char*> bad[] = {
      {"input_path=a\nnosuch=1\n", "'nosuch'"},
      {"input_path=a\n[FoamTraining]\ntest_every=1\n", "'FoamTraining.test_every'"},
      {"input_path=a\njust words\n", "line 2"},
      {"input_path=a\ninput_path=b\n", "'input_path' more than once"},
      {"input_path=a\ntest_every=x\n", "('x') for option '--test_every'"},
      {"input_path=a\nproject_path=other.ini\n", "'project_path'"},
  };
  for (const auto& [text, what] : bad) {
    const std::string project = WriteProject(text);
    const std::string error = Command().Error({"--project_path", project.c_str()});
    EXPECT_THAT(error, HasSubstr(project)) << text;
    EXPECT_THAT(error, HasSubstr(what)) << text;
  }
  EXPECT_THAT(Command().Error({"--project_path", "no/such.ini"}), HasSubstr("no/such.ini"));
  EXPECT_THAT(Command().Error({"--project_path", testing::TempDir().c_str()}),
              HasSubstr("is a folder"));
}

TEST(OptionManager, HelpNeedsNothingElseAndShowsDefaultsAndChoices) {
  testing::internal::CaptureStdout();
  EXPECT_FALSE(Command().Parse({"-h"}));
  std::string help = testing::internal::GetCapturedStdout();
  EXPECT_THAT(help, HasSubstr("--test_every arg (=0)"));
  EXPECT_THAT(help, HasSubstr("--FoamTraining.num_rays arg (=100)"));
  EXPECT_THAT(help, HasSubstr("{low, medium}"));
  EXPECT_THAT(help, HasSubstr("(required) the model"));
  EXPECT_THAT(help, HasSubstr("--project_path"));
  EXPECT_THAT(help, HasSubstr("--device arg (=cpu)"));
  EXPECT_THAT(help, HasSubstr("6 more options: semfoam foam_trainer --help_all"));
  EXPECT_THAT(help, Not(HasSubstr("--num_threads")));
  testing::internal::CaptureStdout();
  EXPECT_FALSE(Command().Parse({"--help_all"}));
  help = testing::internal::GetCapturedStdout();
  EXPECT_THAT(help, HasSubstr("--num_threads arg (=-1)"));
  EXPECT_THAT(help, HasSubstr("Options of FoamTraining:\n  --FoamTraining.num_rays"));
  EXPECT_THAT(help, Not(HasSubstr("more options")));
}

TEST(OptionManager, ShortHelpListsTheFrequentOptionsAndAllHelpAll) {
  Command command;
  command.options.SetFrequentOptions({"quality", "num_threads"});
  const std::string help = command.options.Help();
  for (const char* shown : {"--input_path arg", "--quality arg", "--num_threads arg"}) {
    EXPECT_THAT(help, HasSubstr(shown));
  }
  EXPECT_THAT(help, Not(HasSubstr("--test_every")));
  EXPECT_THAT(help, HasSubstr("12 more options"));
  const std::string all = command.options.Help(/*all=*/true);
  for (const OptionDescription& option : command.options.Description().options) {
    EXPECT_THAT(all, HasSubstr("  --" + option.name + " arg")) << option.name;
  }
}

TEST(OptionManager, HelpTellsWhatTheChosenPresetPresets) {
  for (const auto& [arguments, rays] :
       {std::pair(std::vector<const char*>{"-h"}, "100"),
        std::pair(std::vector<const char*>{"--quality", "low", "-h"}, "10")}) {
    testing::internal::CaptureStdout();
    EXPECT_FALSE(Command().Parse(arguments));
    const std::string help = testing::internal::GetCapturedStdout();
    EXPECT_THAT(help,
                HasSubstr(std::string(" presets:\n  --FoamTraining.num_rays ") + rays + "\n"));
  }
}

TEST(OptionManager, NamesWithoutTheirGroupAreUnderstoodWhereOneIsMeant) {
  Command command;
  int64_t more_rays = 0;
  float step = 0;
  command.options.AddDefaultOption("Effects.step", &step, "another step");
  command.options.AddDefaultOption("Effects.test_every", &more_rays, "hidden by an option");
  EXPECT_TRUE(command.Parse({"--input_path", "x", "--num_rays", "300e3", "--test_every", "4"}));
  EXPECT_EQ(command.num_rays, 300'000);
  EXPECT_EQ(command.test_every, 4);
  EXPECT_EQ(more_rays, 0);
  EXPECT_TRUE(command.options.IsGiven("FoamTraining.num_rays"));
  EXPECT_EQ(command.Error({"--input_path", "x", "--step", "1"}),
            "Failed to parse options - the option '--step' may mean '--FoamTraining.step' or "
            "'--Effects.step'; give the name with its group.");
  EXPECT_THAT(command.Error({"--input_path", "x", "--num_rays", "1", "--FoamTraining.num_rays=1"}),
              HasSubstr("'--FoamTraining.num_rays' is given more than once"));
  const std::string project = WriteProject("num_rays = 2k\nstep = 1\n");
  EXPECT_THAT(command.Error({"--input_path", "x", "--project_path", project.c_str()}),
              HasSubstr(project + ": the option '--step' may mean"));
}

TEST(OptionManager, TellsWhatAMisspeltOptionMayMean) {
  const std::pair<const char*, const char*> misspelt[] = {
      {"--inptu_path", "input_path"},
      {"--num_ray", "FoamTraining.num_rays"},
      {"--FoamTraning.num_rays", "FoamTraining.num_rays"},
      {"--voxel-size", "voxel_size"},
      {"--NumThreads", "num_threads"},
      {"--help_al", "help_all"},
  };
  for (const auto& [name, meant] : misspelt) {
    EXPECT_THAT(Command().Error({"--input_path", "a", name, "1"}),
                EndsWith(std::string("; is '--") + meant + "' meant?"))
        << name;
  }
  const std::string project = WriteProject("input_pth = a\n");
  EXPECT_THAT(Command().Error({"--project_path", project.c_str()}),
              EndsWith("does not have; is '--input_path' meant?"));
}

TEST(OptionManager, ReadsNumbersAsPeopleWriteThem) {
  const std::tuple<const char*, int64_t, double> written[] = {{"300e3", 300'000, 3e5},
                                                              {"20M", 20'000'000, 2e7},
                                                              {"1.5k", 1500, 1500},
                                                              {"2K", 2000, 2000},
                                                              {"1.2G", 1'200'000'000, 1.2e9},
                                                              {"1.5e+3", 1500, 1500},
                                                              {"8.0", 8, 8},
                                                              {"120e-1", 12, 12},
                                                              {"-.5k", -500, -500},
                                                              {"0.0e-9", 0, 0}};
  for (const auto& [text, whole, number] : written) {
    Command command;
    EXPECT_TRUE(command.Parse(
        {"--input_path", "a", "--num_rays", text, "--test_every", text, "--voxel_size", text}));
    EXPECT_EQ(command.num_rays, whole) << text;
    EXPECT_EQ(command.test_every, whole) << text;
    EXPECT_EQ(command.voxel_size, number) << text;
  }
  // Every digit of a large integer is kept.
  Command seed;
  EXPECT_TRUE(seed.Parse({"--input_path", "a", "--random_seed", "18446744073709551.615k"}));
  EXPECT_EQ(seed.options.RandomSeed(), std::numeric_limits<uint64_t>::max());
}

TEST(OptionManager, GivesItsCommandLineBackForAShell) {
  Command command;
  ASSERT_TRUE(command.Parse(
      {"--input_path", "it's a \"model\" $HOME", "--preview=0", "--FoamTraining.step=-1"}));
  EXPECT_EQ(
      command.options.CommandLineWith("a b/semfoam", "preview", "1"),
      "'a b/semfoam' foam_trainer --input_path 'it'\\''s a \"model\" $HOME' --FoamTraining.step=-1 "
      "--preview 1");
  EXPECT_EQ(command.options.CommandLineWith("semfoam", "FoamTraining.step", "2"),
            "semfoam foam_trainer --input_path 'it'\\''s a \"model\" $HOME' --preview=0 "
            "--FoamTraining.step 2");
  // An empty word stays one.
  Command other;
  ASSERT_TRUE(other.Parse({"--input_path", "a", "--labels_path", "", "--preview", "0"}));
  EXPECT_EQ(other.options.CommandLineWith("semfoam", "preview", "1"),
            "semfoam foam_trainer --input_path a --labels_path '' --preview 1");
}

TEST(OptionManager, GroupValuesReadBackAsTheSameValues) {
  Command command;
  EXPECT_TRUE(command.Parse({"--input_path", "a", "--FoamTraining.step", "0.1"}));
  const auto values = command.options.GroupValues("FoamTraining");
  EXPECT_THAT(values,
              testing::ElementsAre(testing::Pair("num_rays", "100"), testing::Pair("step", "0.1")));
  for (const double value : {0.1, 1.0 / 3, 1e-300, 123456789.123456789}) {
    double back = 0;
    EXPECT_TRUE(ParseValue(FormatValue(value), &back));
    EXPECT_EQ(back, value);
  }
}

TEST(OptionManagerPresets, GrowFromLowToExtremeAndAreValid) {
  int64_t rays = 0;
  int sites = 0;
  for (const auto& [quality, name] : kQualityNames) {
    const TrainingOptions options = OptionsForQuality(quality);
    EXPECT_GT(options.num_rays, rays) << name;
    EXPECT_GT(options.final_sites, sites) << name;
    EXPECT_EQ(options.Check(), "") << name;
    rays = options.num_rays;
    sites = options.final_sites;
  }
  EXPECT_EQ(std::size(kQualityNames), 4u);
}

TEST(OptionManager, AShortNameIsTheSameOption) {
  const std::string project = WriteProject("rays = 7\n");
  Command command;
  command.options.AddShortName("rays", "FoamTraining.num_rays");
  EXPECT_TRUE(command.Parse({"--input_path", "x", "--rays", "5"}));
  EXPECT_EQ(command.num_rays, 5);
  EXPECT_TRUE(command.options.IsGiven("FoamTraining.num_rays"));
  EXPECT_TRUE(command.Parse({"--input_path", "x", "--FoamTraining.num_rays", "6"}));
  EXPECT_EQ(command.num_rays, 6);
  EXPECT_TRUE(command.Parse({"--input_path", "x", "--project_path", project.c_str()}));
  EXPECT_EQ(command.num_rays, 7);
  // The command line wins, whatever the spelling.
  EXPECT_TRUE(command.Parse(
      {"--input_path", "x", "--project_path", project.c_str(), "--FoamTraining.num_rays", "8"}));
  EXPECT_EQ(command.num_rays, 8);
  EXPECT_THAT(command.Error({"--input_path", "x", "--rays", "1", "--FoamTraining.num_rays", "1"}),
              HasSubstr("'--FoamTraining.num_rays' is given more than once"));
  EXPECT_THAT(command.options.Help(), HasSubstr("--rays is the same"));
}

}  // namespace
}  // namespace semfoam
