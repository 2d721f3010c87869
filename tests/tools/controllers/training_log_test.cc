// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/training_log.h"

#include "foam/util/error.h"
#include "tools/options/quality_plot.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Property;
using ::testing::Throws;

TrainingProgress At(int64_t iteration) {
  TrainingProgress progress;
  progress.iteration = iteration;
  progress.rays = 1000 * iteration;
  progress.sites = 23410;
  progress.seconds = static_cast<double>(iteration);
  return progress;
}

TEST(TrainingLog, HasOneLinePerReportAndAsManyFieldsAsItsHead) {
  TrainingProgress known = At(2);
  known.color_loss = 0.0125;
  known.held_out_psnr = 21.5;
  known.held_out_miou = 0.75;
  known.distance_loss = 0.5;
  const std::string log = FormatTrainingLog({At(1), known});
  std::istringstream lines(log);
  std::string line;
  std::vector<std::string> all;
  while (std::getline(lines, line)) all.push_back(line);
  ASSERT_EQ(all.size(), 3u);
  for (const std::string& each : all) EXPECT_EQ(std::count(each.begin(), each.end(), ','), 11);
  EXPECT_EQ(all[1], "1.000,1,1000,23410,,,,,,,,");
  EXPECT_EQ(all[2], "2.000,2,2000,23410,0.0125,,,,,21.5,0.75,0.5");
}

TEST(TrainingLogPlot, ShowsWhatIsKnownOnceForEachEvaluation) {
  TrainingProgress first = At(1), repeated = At(2), last = At(4);
  first.held_out_psnr = repeated.held_out_psnr = 20;
  last.held_out_psnr = 22;
  const Plot colour = TrainingPlot({{"", {At(0), first, repeated, last}}});
  ASSERT_EQ(colour.panels.size(), 1u);
  const std::vector<PlotPoint>& points = colour.panels[0].series[0].points;
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].x, 1);
  EXPECT_EQ(points[1].x, 4);
  EXPECT_EQ(points[1].y, 22);

  last.held_out_miou = 0.5;
  EXPECT_EQ(TrainingPlot({{"", {first, last}}}).panels.size(), 2u);
  EXPECT_TRUE(TrainingPlot({{"", {At(0), At(4)}}}).panels.empty());
}

TEST(TrainingLogPlot, TellsSeveralTrainingsApart) {
  TrainingProgress colour = At(1), labelled = At(100), unknown = At(3);
  colour.held_out_psnr = labelled.held_out_psnr = 20;
  labelled.held_out_miou = 0.5;
  const Plot plot = TrainingPlot({{"low", {colour}}, {"none", {unknown}}, {"high", {labelled}}});
  ASSERT_EQ(plot.panels.size(), 2u);
  EXPECT_TRUE(plot.panels[0].log_x);
  ASSERT_EQ(plot.panels[0].series.size(), 2u);
  EXPECT_EQ(plot.panels[0].series[0].name, "low");
  EXPECT_EQ(plot.panels[0].series[1].name, "high");
  ASSERT_EQ(plot.panels[1].series.size(), 1u);
  EXPECT_EQ(plot.panels[1].series[0].name, "high");
}

TEST(TrainingLog, ReadsWhatItWrote) {
  TempFolder folder;
  TrainingProgress known = At(2);
  known.seconds = 2.125;
  known.color_loss = 0.0125;
  known.held_out_psnr = 21.5;
  const std::string text = FormatTrainingLog({At(1), known});
  WriteFile(folder / "log.csv", text);
  const std::vector<TrainingProgress> read = ReadTrainingLog(folder / "log.csv");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].seconds, 2.125);
  EXPECT_EQ(read[1].rays, 2000);
  EXPECT_TRUE(std::isnan(read[1].held_out_miou));
  EXPECT_EQ(FormatTrainingLog(read), text);
}

TEST(TrainingLog, ReadsLogsThatEndWithoutTheDistanceLoss) {
  TempFolder folder;
  WriteFile(folder / "log.csv",
            "seconds,iteration,rays,sites,color_loss,opacity_loss,quantile_loss,identity_loss,"
            "tv_loss,held_out_psnr,held_out_miou\n1.5,1,1000,23410,0.01,,,,,21.5,0.75\n");
  const std::vector<TrainingProgress> read = ReadTrainingLog(folder / "log.csv");
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].held_out_miou, 0.75);
  EXPECT_TRUE(std::isnan(read[0].distance_loss));
}

TEST(TrainingLog, RefusesWhatIsNone) {
  TempFolder folder;
  const fs::path path = folder / "log.csv";
  const auto says = [](const char* what) {
    return Throws<UserError>(Property(&UserError::what, HasSubstr(what)));
  };
  EXPECT_THAT([&] { ReadTrainingLog(path); }, says("log.csv: is missing or no training log"));
  WriteFile(path, "a,b\n1,2\n");
  EXPECT_THAT([&] { ReadTrainingLog(path); }, says("is missing or no training log"));
  const std::string good = FormatTrainingLog({At(1)});
  for (const char* line :
       {"1,2,3,4,,,,,,,", "1,2,3,4,,,,,,,,,", "1,2.5,3,4,,,,,,,,", "1,2,3,4,,x,,,,,,", ""}) {
    WriteFile(path, good + line + "\n");
    EXPECT_THAT([&] { ReadTrainingLog(path); }, says("log.csv: line 3 does not hold the numbers"))
        << line;
  }
}

// The program, on the logs of trainings.
class TrainingLogQualityPlot : public ::testing::Test {
 protected:
  void Write(const std::string& run, double psnr) {
    TrainingProgress report = At(7);
    report.held_out_psnr = psnr;
    fs::create_directories(folder_ / run);
    WriteFile(folder_ / run / "training_log.csv", FormatTrainingLog({report}));
  }
  Outcome Run(const std::string& runs, const std::string& names = "") {
    return RunSemfoam({"accuracy_profiler",
                       "--run_paths",
                       runs,
                       "--output_path",
                       (folder_ / "plot").string(),
                       "--names",
                       names});
  }
  TempFolder folder_;
};

TEST_F(TrainingLogQualityPlot, DrawsAllOfThem) {
  Write("low", 20);
  Write("high", 25);
  const std::string runs = (folder_ / "low").string() + "," + (folder_ / "high").string() + "/";
  const Outcome outcome = Run(runs);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string svg = ReadFile(folder_ / "plot" / "quality_over_seconds.svg");
  EXPECT_TRUE(fs::exists(folder_ / "plot" / "quality_over_seconds.png"));
  EXPECT_EQ(Run(runs, "low,low").exit_code, 1);
  EXPECT_EQ(Run(runs, "a,b").exit_code, 0);
  EXPECT_NE(ReadFile(folder_ / "plot" / "quality_over_seconds.svg"), svg);
}

// Names that cannot be drawn as they are: no UTF-8, control characters.
TEST_F(TrainingLogQualityPlot, DrawsAnyName) {
  Write("m\xFC\ng", 20);
  const Outcome outcome = Run((folder_ / "m\xFC\ng").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(folder_ / "plot" / "quality_over_seconds.png"));
  EXPECT_EQ(Run((folder_ / "m\xFC\ng").string(), "a\x01\xFF").exit_code, 0);
}

TEST_F(TrainingLogQualityPlot, RefusesWhatCannotBeDrawn) {
  Write("low", NAN);
  const std::string low = (folder_ / "low").string();
  EXPECT_THAT(Run(low).err, HasSubstr("none of the trainings knows its held-out quality"));
  EXPECT_THAT(Run(low + "," + low).err, HasSubstr("two of the trainings are called `low`"));
  EXPECT_THAT(Run(low, "a,b").err, HasSubstr("names has 2 names for 1 trainings"));
  EXPECT_THAT(Run(low + ",").err, HasSubstr("training_log.csv: is missing"));
  EXPECT_FALSE(fs::exists(folder_ / "plot"));
}

}  // namespace
}  // namespace semfoam
