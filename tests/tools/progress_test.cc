// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/progress.h"

#include "tools/training_log.h"

#include <algorithm>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A run of `num_iterations` of which each takes 1 s and casts 1000 rays.
TrainingProgress At(int64_t iteration, int64_t num_iterations) {
  TrainingProgress progress;
  progress.iteration = iteration;
  progress.num_iterations = num_iterations;
  progress.rays = 1000 * iteration;
  progress.sites = 23410;
  progress.seconds = static_cast<double>(iteration);
  progress.seconds_left = static_cast<double>(num_iterations - iteration);
  return progress;
}

TEST(Progress, FormatsDurations) {
  EXPECT_EQ(FormatDuration(0), "0:00");
  EXPECT_EQ(FormatDuration(-3), "0:00");
  EXPECT_EQ(FormatDuration(59.6), "1:00");
  EXPECT_EQ(FormatDuration(725), "12:05");
  EXPECT_EQ(FormatDuration(3723), "1:02:03");
}

TEST(Progress, SaysWhatIsKnownAndLeavesOutWhatIsNot) {
  TrainingProgress progress = At(72, 144);
  EXPECT_EQ(FormatProgress(progress, 98'400),
            "iteration 72/144, 23410 sites, 98 k rays/s, 1:12 left");
  progress.held_out_psnr = 22.314;
  EXPECT_THAT(FormatProgress(progress, 1.5e6), HasSubstr("1.50 M rays/s, held-out 22.31 dB"));
  progress.seconds_left = NAN;
  EXPECT_THAT(FormatProgress(progress, NAN), Not(HasSubstr("left")));
  EXPECT_THAT(FormatProgress(progress, NAN), Not(HasSubstr("rays/s")));
}

TEST(Progress, WritesPlainLinesNowAndThenWhereThereIsNoTerminal) {
  std::ostringstream out;
  {
    ProgressLine line(out, /*is_terminal=*/false, /*seconds_between_lines=*/10);
    for (int i = 1; i <= 35; ++i) line.Update(At(i, 35));
  }
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4) << text;  // at 10, 20, 30 s, and the end
  EXPECT_THAT(text, Not(HasSubstr("\r")));
  EXPECT_THAT(text, HasSubstr("iteration 35/35"));
  EXPECT_THAT(text, HasSubstr("1 k rays/s"));
}

TEST(Progress, RedrawsOneLineInPlaceOnATerminal) {
  std::ostringstream out;
  {
    ProgressLine line(out, /*is_terminal=*/true);
    for (int i = 1; i <= 5; ++i) line.Update(At(i, 5));
    EXPECT_THAT(out.str(), Not(HasSubstr("\n")));
  }
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 5);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

TEST(Progress, ShowsOtherWorkNowAndThen) {
  std::ostringstream out;
  {
    ProgressLine line(out, /*is_terminal=*/false, /*seconds_between_lines=*/10);
    for (int k = 0; k <= 350; ++k) line.Show("part " + std::to_string(k), 0.1 * k);
  }
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3) << text;
  EXPECT_THAT(text, HasSubstr("part 100\n"));
  EXPECT_THAT(text, Not(HasSubstr("\r")));
}

TEST(Progress, AClearedLineLeavesTheTerminalToOthers) {
  std::ostringstream out;
  {
    ProgressLine line(out, /*is_terminal=*/true);
    line.Show("a", 0.2);
    line.Show("too soon", 0.21);
    line.Clear();
    line.Clear();
  }
  EXPECT_EQ(out.str(), "\ra\x1b[K\r\x1b[K");
}

TEST(Progress, WritesNothingForARunThatNeverReports) {
  std::ostringstream out;
  { ProgressLine line(out, /*is_terminal=*/true); }
  EXPECT_EQ(out.str(), "");
}

TEST(TrainingLog, HasOneLinePerReportAndAsManyFieldsAsItsHead) {
  TrainingProgress known = At(2, 3);
  known.color_loss = 0.0125;
  known.held_out_psnr = 21.5;
  known.held_out_miou = 0.75;
  const std::string log = FormatTrainingLog({At(1, 3), known});
  std::istringstream lines(log);
  std::string line;
  std::vector<std::string> all;
  while (std::getline(lines, line)) all.push_back(line);
  ASSERT_EQ(all.size(), 3u);
  for (const std::string& each : all) EXPECT_EQ(std::count(each.begin(), each.end(), ','), 10);
  EXPECT_EQ(all[1], "1.000,1,1000,23410,,,,,,,");
  EXPECT_EQ(all[2], "2.000,2,2000,23410,0.0125,,,,,21.5,0.75");
}

TEST(TrainingPlot, ShowsWhatIsKnownOnceForEachEvaluation) {
  TrainingProgress first = At(1, 4), repeated = At(2, 4), last = At(4, 4);
  first.held_out_psnr = repeated.held_out_psnr = 20;
  last.held_out_psnr = 22;
  const Plot colour = TrainingPlot({At(0, 4), first, repeated, last});
  ASSERT_EQ(colour.panels.size(), 1u);
  const std::vector<PlotPoint>& points = colour.panels[0].series[0].points;
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].x, 1);
  EXPECT_EQ(points[1].x, 4);
  EXPECT_EQ(points[1].y, 22);

  last.held_out_miou = 0.5;
  EXPECT_EQ(TrainingPlot({first, last}).panels.size(), 2u);
  EXPECT_TRUE(TrainingPlot({At(0, 4), At(4, 4)}).panels.empty());
}

}  // namespace
}  // namespace semfoam
