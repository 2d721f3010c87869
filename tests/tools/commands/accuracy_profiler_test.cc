// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/accuracy_study.h"

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

AccuracyRow Row(const std::string& sweep, const std::string& value, double seconds, double psnr) {
  AccuracyRow row;
  row.sweep = sweep;
  row.value = value;
  row.seconds = seconds;
  row.psnr = psnr;
  return row;
}

TEST(AccuracyProfilerStudy, ChangesOneThingAtATime) {
  TrainingOptions base;
  base.sh_degree = 1;
  const std::vector<StudyRun> runs = SweepsAround(base, 640, /*base_sweeps=*/true);
  std::map<std::string, int> counts;
  for (const StudyRun& run : runs) {
    ++counts[run.sweep];
    const TrainingOptions& o = run.training;
    const int changed = (o.num_rays != base.num_rays) + (o.final_sites != base.final_sites) +
                        (run.max_image_size != -1) + (o.sh_degree != base.sh_degree) +
                        (o.transmittance_cutoff != base.transmittance_cutoff) +
                        (o.color_gradient_rate != base.color_gradient_rate) +
                        (o.color_tv_weight != base.color_tv_weight) +
                        (o.distance_weight != base.distance_weight) + !run.sweeps;
    EXPECT_EQ(changed, 1) << run.sweep << " " << run.value;
    EXPECT_EQ(o.Check(), "");
  }
  const std::set<std::string> left_out = {
      "color_gradient_rate", "color_tv_weight", "distance_weight", "sweep_photos"};
  EXPECT_EQ(counts.size(), 5 + left_out.size());
  for (const auto& [sweep, count] : counts) {
    if (left_out.contains(sweep)) {
      EXPECT_EQ(count, 1) << sweep;
    } else {
      EXPECT_GE(count, 2) << sweep;
    }
  }
  EXPECT_EQ(counts["sh_degree"], 3);
  // Whatever is cut off at the end, the first ones are different ones.
  std::set<std::string> first;
  for (size_t i = 0; i < counts.size(); ++i) first.insert(runs[i].sweep);
  EXPECT_EQ(first.size(), counts.size());
  // Sites out of range are left out, not trained.
  base.final_sites = 100;
  for (const StudyRun& run : SweepsAround(base, 640, true)) {
    EXPECT_GE(run.training.final_sites, 64);
  }
}

TEST(AccuracyProfilerStudy, LeavesOutWhatTheBaseHasOnly) {
  TrainingOptions base;
  base.color_tv_weight = 0;
  for (const StudyRun& run : SweepsAround(base, 640, /*base_sweeps=*/false)) {
    EXPECT_TRUE(run.sweeps);
    EXPECT_NE(run.sweep, "color_tv_weight");
    EXPECT_NE(run.sweep, "distance_weight");
    EXPECT_NE(run.sweep, "sweep_photos");
  }
}

TEST(AccuracyProfilerStudy, TheFrontIsWhatNothingBeats) {
  const std::vector<PlotPoint> points = {{3, 20}, {1, 10}, {2, 9}, {4, 20}, {5, 30}, {2, NAN}};
  const auto is = [](const std::vector<PlotPoint>& front, std::vector<double> x) {
    ASSERT_EQ(front.size(), x.size());
    for (size_t i = 0; i < x.size(); ++i) EXPECT_EQ(front[i].x, x[i]);
  };
  is(ParetoFront(points, /*less_is_better=*/false), {1, 3, 5});
  is(ParetoFront(points, /*less_is_better=*/true), {1, 2});
  is(ParetoFront({}, false), {});
}

TEST(AccuracyProfilerStudy, TableAndPlotShowWhatIsKnown) {
  const std::vector<AccuracyRow> rows = {
      Row("base", "x", 10, 20), Row("num_rays", "1", 5, 15), Row("sh_degree", "3", 12, 19)};
  const std::string table = FormatAccuracyTable(rows);
  EXPECT_THAT(table, HasSubstr("**20.00**"));
  EXPECT_THAT(table, HasSubstr("**15.00**"));
  EXPECT_THAT(table, HasSubstr("| 19.00 |"));
  EXPECT_THAT(table, Not(HasSubstr("nan")));
  const std::string csv = FormatAccuracyCsv(rows);
  EXPECT_THAT(csv, HasSubstr("base,x,0,0,0,0,0,10.000,20,,,\n"));
  const Plot plot = AccuracyPlot(rows);
  ASSERT_EQ(plot.panels.size(), 1u);  // nothing but PSNR is known
  ASSERT_EQ(plot.panels[0].series.size(), 3u);
  // A sweep's line leads through the base, in the order of the seconds.
  const std::vector<PlotPoint>& rays = plot.panels[0].series[1].points;
  ASSERT_EQ(rays.size(), 2u);
  EXPECT_EQ(rays[0].x, 5);
  EXPECT_EQ(rays[1].x, 10);
  EXPECT_EQ(plot.panels[0].front.size(), 2u);
}

TEST(AccuracyProfiler, StudiesTheTabletopInSeconds) {
  const TempFolder folder;
  const Outcome outcome = RunSemfoam({"accuracy_profiler",
                                      "--workspace_path",
                                      kTabletop.string(),
                                      "--output_path",
                                      (folder / "out").string(),
                                      "--budget",
                                      "6",
                                      "--FoamTraining.max_image_size",
                                      "80"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Plan for 0:06"));
  EXPECT_THAT(
      FilesBelow(folder / "out"),
      testing::UnorderedElementsAre("accuracy.csv", "accuracy.md", "accuracy.svg", "accuracy.png"));
  std::istringstream lines(ReadFile(folder / "out" / "accuracy.csv"));
  std::string line;
  std::getline(lines, line);
  const auto fields = std::count(line.begin(), line.end(), ',');
  std::map<std::string, std::vector<double>> surface_errors;
  while (std::getline(lines, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), fields) << line;
    const std::string error = line.substr(line.rfind(',') + 1);
    surface_errors[line.substr(0, line.find(','))].push_back(error.empty() ? NAN
                                                                           : std::stod(error));
  }
  ASSERT_EQ(surface_errors["base"].size(), 1u) << outcome.err;
  // The table is 2 m wide and seen from some 3 m.
  EXPECT_LT(surface_errors["base"][0], 1);
  // How much more there is, is a matter of time.
  EXPECT_EQ(surface_errors["supersample"].size(), 1u);
  EXPECT_GE(surface_errors["surface"].size(), 1u);
  EXPECT_GE(surface_errors["VolumeExport.max_resolution"].size(), 1u);
}

TEST(AccuracyProfiler, SaysInOneSentenceWhatIsWrong) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--budget", "0"}, "--budget is 0; it must be"},
      {{"--test_every", "0"}, "--test_every 0 holds out no photo"},
      {{"--FoamTraining.time_budget", "9"}, "--budget sizes a study"}};
  for (const auto& [arguments, sentence] : cases) {
    std::vector<std::string> all = {
        "accuracy_profiler", "--workspace_path", kTabletop.string(), "--output_path", "/proc/x"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome outcome = RunSemfoam(all);
    EXPECT_EQ(outcome.exit_code, 1);
    ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr(sentence));
  }
}

}  // namespace
}  // namespace semfoam
