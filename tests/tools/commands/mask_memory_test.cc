// SPDX-License-Identifier: GPL-3.0-or-later
//
// The commands that read masks alone have one of them in memory at a time, however many there are.
#include <cstdlib>

#include "tests/process_state.h"
#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include "tests/tools/ring_capture.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// 50 masks of 0.48 MP are 24 MB of pixels, and 48 with two bytes each.
constexpr int kWidth = 800, kHeight = 600;
constexpr int64_t kMostForMore = 12'000'000;

class MaskMemoryTest : public testing::Test {
 protected:
  MaskMemoryTest() : capture_(folder_ / "w", 50, kWidth, kHeight) {
    fs::create_directories(folder_ / "one");
    fs::create_hard_link(folder_ / "w/object_mask/000_07.png", folder_ / "one/000_07.png");
  }

  // The masks of all photos take no more memory than that of one.
  void ExpectOneAtATime(const std::vector<std::string>& command, const std::string& with_all) {
    int64_t peak[2] = {};
    for (const bool all : {false, true}) {
      std::vector<std::string> arguments = command;
      const fs::path masks = all ? folder_ / "w/object_mask" : folder_ / "one";
      const fs::path output = folder_ / (command[0] + (all ? " all" : " one"));
      arguments.insert(
          arguments.end(),
          {"--mask_path", masks.string(), "--output_path", output.string(), "--num_threads", "1"});
      const MeasuredRun run = MeasureSemfoam(arguments);
      ASSERT_EQ(run.outcome.exit_code, 0) << run.outcome.err;
      if (all) {
        EXPECT_THAT(run.outcome.out + run.outcome.err, HasSubstr(with_all));
      }
      peak[all] = run.peak_bytes;
    }
    std::printf("%s: %.1f MB with one mask, %.1f MB with 50\n",
                command[0].c_str(),
                peak[0] / 1e6,
                peak[1] / 1e6);
    EXPECT_LT(peak[1], peak[0] + kMostForMore) << command[0];
  }

  const TempFolder folder_;
  const RingCapture capture_;
};

TEST_F(MaskMemoryTest, OneMaskIsInMemoryAtATime) {
  // What is freed counts as free, under AddressSanitizer too.
  const char* const given = std::getenv("ASAN_OPTIONS");
  const EnvironmentVariable options("ASAN_OPTIONS",
                                    given != nullptr ? given : "quarantine_size_mb=1");
  const std::string workspace = (folder_ / "w").string();
  ExpectOneAtATime({"mask_analyzer", "--workspace_path", workspace}, "50 masks for 50 photos");
  ExpectOneAtATime({"point_labeler", "--workspace_path", workspace}, "50 of 50 photos have a mask");
}

}  // namespace
}  // namespace semfoam
