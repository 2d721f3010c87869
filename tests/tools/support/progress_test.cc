// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/progress.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

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
    ProgressLine line(out, ProgressStyle::kLines, /*seconds_between_lines=*/10);
    for (int i = 1; i <= 35; ++i) line.Update(At(i, 35));
  }
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4) << text;  // at 10, 20, 30 s, and the end
  EXPECT_THAT(text, Not(HasSubstr("\r")));
  EXPECT_THAT(text, HasSubstr("iteration 35/35"));
  EXPECT_THAT(text, HasSubstr("1 k rays/s"));
}

TEST(Progress, ABarIsOneLineThatIsRedrawnInPlace) {
  std::ostringstream out;
  {
    ProgressLine line(out, ProgressStyle::kBar);
    for (int i = 1; i <= 5; ++i) line.Update(At(i, 5));
    EXPECT_THAT(out.str(), Not(HasSubstr("\n")));
  }
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 5);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

TEST(Progress, ABarTellsShareTimeAndQualityInTheWidthOfTheTerminal) {
  TrainingProgress progress = At(72, 144);
  progress.held_out_psnr = 22.314;
  const auto drawn = [&](int columns) {
    std::ostringstream out;
    ProgressLine line(out, ProgressStyle::kBar, 10, columns);
    line.Update(progress);
    return out.str();
  };
  EXPECT_EQ(drawn(80),
            "\r[##############--------------]  50 %, 1:12 left, held-out 22.31 dB, 23410 sites"
            "\x1b[K");
  EXPECT_EQ(drawn(30), "\r[#####-----]  50 %, 1:12 left\x1b[K");
  progress = At(144, 144);
  EXPECT_EQ(drawn(80), "\r[############################] 100 %, 0:00 left, 23410 sites\x1b[K");
}

TEST(Progress, JsonIsAnObjectALineOnceASecond) {
  std::ostringstream out;
  {
    ProgressLine line(out, ProgressStyle::kJson);
    for (int k = 0; k <= 20; ++k) line.Show(CountProgress("checking photos", k, 20, 0.25 * k));
    TrainingProgress progress = At(72, 144);
    line.Update(progress);
    progress.held_out_psnr = 22.5;
    progress.iteration = 144;
    line.Update(progress);
  }
  std::vector<nlohmann::json> objects;
  std::istringstream lines(out.str());
  for (std::string text; std::getline(lines, text);) objects.push_back(nlohmann::json::parse(text));
  ASSERT_EQ(objects.size(), 7u) << out.str();
  EXPECT_EQ(
      objects[0],
      nlohmann::json(
          {{"task", "checking photos"}, {"share", 0.2}, {"seconds", 1}, {"seconds_left", 4}}));
  EXPECT_EQ(objects[5]["task"], "training");
  EXPECT_EQ(objects[5]["share"], 0.5);
  EXPECT_EQ(objects[5]["seconds_left"], 72);
  EXPECT_EQ(objects[5]["sites"], 23410);
  EXPECT_FALSE(objects[5].contains("held_out_psnr"));
  EXPECT_EQ(objects[6]["held_out_psnr"], 22.5);
}

TEST(Progress, ThereIsAStyleWithoutOutput) {
  std::ostringstream out;
  {
    ProgressLine line(out, ProgressStyle::kNone);
    line.Update(At(5, 5));
    line.Show(CountProgress("checking photos", 1, 2, 100));
  }
  EXPECT_EQ(out.str(), "");
}

TEST(Progress, ShowsOtherWorkNowAndThen) {
  std::ostringstream out;
  {
    ProgressLine line(out, ProgressStyle::kLines, /*seconds_between_lines=*/10);
    for (int k = 0; k <= 350; ++k) line.Show({"part", 0, 0.1 * k, "part " + std::to_string(k)});
  }
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3) << text;
  EXPECT_THAT(text, HasSubstr("part 100\n"));
  EXPECT_THAT(text, Not(HasSubstr("\r")));
}

TEST(Progress, AClearedLineLeavesTheTerminalToOthers) {
  std::ostringstream out;
  {
    ProgressLine line(out, ProgressStyle::kBar, 10, 20);
    line.Show({"a", 0.5, 0.2, ""});
    line.Show({"too soon", 0.5, 0.21, ""});
    line.Clear();
    line.Clear();
  }
  EXPECT_EQ(out.str(), "\r[#####-----]  50 %,\x1b[K\r\x1b[K");
}

TEST(Progress, WritesNothingForARunThatNeverReports) {
  std::ostringstream out;
  { ProgressLine line(out, ProgressStyle::kBar); }
  EXPECT_EQ(out.str(), "");
}

}  // namespace
}  // namespace semfoam
