// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/time_budget.h"

#include "tools/controllers/presets.h"

#include <cmath>
#include <sstream>

#include "tests/foam/synthetic_views.h"
#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include "tests/tools/ring_capture.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;

TEST(TimeBudgetPresetLine, GoesThroughThePresets) {
  for (const auto& [quality, name] : kQualityNames) {
    const TrainingOptions preset = OptionsForQuality(quality);
    const TrainingOptions line = OptionsOnPresetLine(preset.num_rays);
    EXPECT_EQ(line.num_rays, preset.num_rays) << name;
    EXPECT_NEAR(line.final_sites, preset.final_sites, 0.01 * preset.final_sites) << name;
    EXPECT_NEAR(line.rays_per_iteration, preset.rays_per_iteration, 128) << name;
    EXPECT_EQ(line.sh_degree, preset.sh_degree) << name;
    EXPECT_EQ(line.densify_events, preset.densify_events) << name;
  }
}

TEST(TimeBudgetPresetLine, GrowsWithTheRaysAndIsValidEverywhere) {
  int sites = 0;
  for (double rays = 1; rays < 1e13; rays *= 3) {
    const TrainingOptions options = OptionsOnPresetLine(std::llround(rays));
    EXPECT_EQ(options.Check(), "") << rays;
    EXPECT_GE(options.final_sites, sites) << rays;
    sites = options.final_sites;
  }
  EXPECT_EQ(sites, OptionsForQuality(Quality::kExtreme).final_sites);
}

TEST(TimeBudgetModel, FillsSecondsOnTheLine) {
  const SyntheticViews views(8, 32, 24);
  const TrainingTimeModel model(views, views.Seeds(500), 3, Device(), 0.1);
  const int64_t rays = model.RaysOnPresetLine(100);
  const TrainingOptions options = OptionsOnPresetLine(rays);
  EXPECT_NEAR(model.TrainingSeconds(options) + model.ClosingSeconds(options), 100, 2);
  EXPECT_GT(model.RaysOnPresetLine(200), rays);
  TrainingOptions more = options;
  more.late_rays = options.num_rays;
  EXPECT_GT(model.TrainingSeconds(more), model.TrainingSeconds(options));
}

// A budget chooses a schedule and says it; given by name, that schedule gives the same bytes.
TEST(TimeBudget, ItsScheduleCanBeRepeated) {
  const TempFolder folder;
  const std::vector<std::string> common = {"foam_trainer",
                                           "--image_path",
                                           (kTabletop / "images").string(),
                                           "--input_path",
                                           (kTabletop / "sparse/0").string(),
                                           "--FoamTraining.tv_weight",
                                           "1.5",
                                           "--FoamTraining.sh_degree",
                                           "0"};
  std::vector<std::string> with_budget = common;
  with_budget.insert(
      with_budget.end(),
      {"--FoamTraining.time_budget", "3", "--output_path", (folder / "budget").string()});
  const Outcome outcome = RunSemfoam(with_budget);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string says = "without a budget: ";
  ASSERT_THAT(outcome.err, HasSubstr(says));
  const size_t begin = outcome.err.find(says) + says.size();
  std::istringstream words(outcome.err.substr(begin, outcome.err.find('\n', begin) - begin));
  std::vector<std::string> again = common;
  again.resize(common.size() - 2);  // --FoamTraining.sh_degree is among what it said
  for (std::string word; words >> word;) again.push_back(word);
  again.insert(again.end(), {"--output_path", (folder / "again").string()});
  const Outcome repeated = RunSemfoam(again);
  ASSERT_EQ(repeated.exit_code, 0) << repeated.err;
  EXPECT_EQ(ReadFile(folder / "budget" / "scene.foam"), ReadFile(folder / "again" / "scene.foam"));
}

// What comes before and after the iterations is within the budget too. Time of the processor, on
// one thread: on a busy machine that is less than the budget's seconds, never more. Loading alone
// takes 3 s, and 8 s where other processes share caches and cores, so the budget is well above.
TEST(TimeBudget, HoldsWithManyPhotosAndPoints) {
  const TempFolder folder;
  const RingCapture capture(folder / "workspace", 1000, 32, 24, /*num_points=*/300'000);
  const MeasuredRun run = MeasureSemfoam({"foam_trainer",
                                          "--image_path",
                                          (folder / "workspace/images").string(),
                                          "--input_path",
                                          (folder / "workspace/sparse/0").string(),
                                          "--output_path",
                                          (folder / "out").string(),
                                          "--num_threads",
                                          "1",
                                          "--FoamTraining.time_budget",
                                          "16"});
  ASSERT_EQ(run.outcome.exit_code, 0) << run.outcome.err;
  EXPECT_LT(run.cpu_seconds, 20) << run.outcome.err;
}

TEST(TimeBudget, IsNotGivenTogetherWithANumberOfRays) {
  const Outcome outcome = RunSemfoam({"foam_trainer",
                                      "--image_path",
                                      "x",
                                      "--input_path",
                                      "x",
                                      "--output_path",
                                      "x",
                                      "--FoamTraining.num_rays",
                                      "1000",
                                      "--FoamTraining.time_budget",
                                      "10"});
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
  EXPECT_THAT(outcome.Errors()[0], HasSubstr("give one of them"));
}

}  // namespace
}  // namespace semfoam
