// SPDX-License-Identifier: GPL-3.0-or-later
//
// 2000 photos of 12 MP, which would take 84 GB with their masks, are trained on within 8 GB.
#include <cstdio>

#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include "tests/tools/ring_capture.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::HasSubstr;

// The held-out PSNR of the log's first and last lines that have one.
std::pair<double, double> FirstAndLastPsnr(const std::string& log) {
  std::istringstream lines(log);
  std::string line;
  std::getline(lines, line);
  double first = 0, last = 0;
  while (std::getline(lines, line)) {
    std::vector<std::string> fields;
    std::istringstream in(line);
    for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
    if (fields.size() < 10 || fields[9].empty()) continue;
    last = std::stod(fields[9]);
    if (first == 0) first = last;
  }
  return {first, last};
}

TEST(Load, TwoThousandPhotosOf12MegapixelsTrainWithin8Gigabytes) {
  constexpr int64_t kLimit = 8'000'000'000;
  const TempFolder folder;
  const RingCapture capture(folder / "w", 2000, 4000, 3000);
  const MeasuredRun run = MeasureSemfoam(TinyTraining({"foam_trainer",
                                                       "--image_path",
                                                       (folder / "w/images").string(),
                                                       "--input_path",
                                                       (folder / "w/sparse/0").string(),
                                                       "--mask_path",
                                                       (folder / "w/object_mask").string(),
                                                       "--output_path",
                                                       (folder / "out").string(),
                                                       "--test_every",
                                                       "100",
                                                       "--FoamTraining.num_rays",
                                                       "4000000",
                                                       "--FoamTraining.rays_per_iteration",
                                                       "4096",
                                                       "--FoamTraining.final_sites",
                                                       "30000"}),
                                         kLimit);
  std::printf("%s\npeak %.0f MB\n", run.outcome.err.c_str(), run.peak_bytes / 1e6);
  ASSERT_EQ(run.outcome.exit_code, 0);
  EXPECT_THAT(run.outcome.err,
              HasSubstr("Of 2000 photos (84.00 GB) only the pixels that are drawn"));
  EXPECT_THAT(run.outcome.err, HasSubstr("checking photos "));
  EXPECT_THAT(run.outcome.err, HasSubstr("reading photos "));
  EXPECT_LT(run.peak_bytes, kLimit);
  const double planned = LastBytesBefore(run.outcome.err, "in all");
  EXPECT_NEAR(planned / static_cast<double>(run.peak_bytes), 1, 0.1);
  const auto [first, last] = FirstAndLastPsnr(ReadFile(folder / "out/training_log.csv"));
  std::printf("held-out PSNR %.2f dB at first, %.2f dB at last\n", first, last);
  EXPECT_GT(first, 5);
  EXPECT_GT(last, first + 2);
}

}  // namespace
}  // namespace semfoam
