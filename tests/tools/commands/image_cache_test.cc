// SPDX-License-Identifier: GPL-3.0-or-later
//
// Photos that do not fit into --image_cache_gb: the same foam, in less memory.
#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include "tests/tools/ring_capture.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

class ImageCacheTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const RingCapture capture(*folder_ / "w", 50, 480, 360);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  // 50 photos of 0.17 MP take 26 MB, and their 50 masks 17.
  static std::vector<std::string> Command(const std::string& cache_gb) {
    return TinyTraining({"foam_trainer",
                         "--image_path",
                         (*folder_ / "w/images").string(),
                         "--input_path",
                         (*folder_ / "w/sparse/0").string(),
                         "--mask_path",
                         (*folder_ / "w/object_mask").string(),
                         "--output_path",
                         (*folder_ / "out").string(),
                         "--test_every",
                         "25",
                         "--FoamTraining.num_rays",
                         "100000",
                         "--FoamTraining.final_sites",
                         "2000",
                         "--overwrite",
                         "1",
                         "--image_cache_gb",
                         cache_gb});
  }

  static TempFolder* folder_;
};

TempFolder* ImageCacheTest::folder_ = nullptr;

TEST_F(ImageCacheTest, GivesTheSameFoamInLessMemory) {
  std::vector<std::string> command = Command("10");
  const MeasuredRun whole = MeasureSemfoam(command);
  ASSERT_EQ(whole.outcome.exit_code, 0) << whole.outcome.err;
  EXPECT_THAT(whole.outcome.err, HasSubstr("Loading 50 photos (43 MB)"));
  const std::string foam = ReadFile(*folder_ / "out/scene.foam");

  // Too little for the pixels of the run (0.7 MB, and 0.5 that are looked at again and again): read
  // again and again.
  for (const char* threads : {"1", "2", "5"}) {
    command = Command("0.001");
    command.insert(command.end(), {"--num_threads", threads});
    const MeasuredRun small = MeasureSemfoam(command);
    ASSERT_EQ(small.outcome.exit_code, 0) << small.outcome.err;
    EXPECT_THAT(small.outcome.err,
                AllOf(HasSubstr("Of 50 photos (43 MB) only the pixels that are drawn are kept"),
                      testing::ContainsRegex("in up to 1 MB \\(-*image_cache_gb\\)")));
    EXPECT_TRUE(ReadFile(*folder_ / "out/scene.foam") == foam) << threads << " threads";
    EXPECT_LT(small.peak_bytes, whole.peak_bytes - 20'000'000);
  }
  EXPECT_EQ(ReadFile(*folder_ / "out/training_log.csv").find("nan"), std::string::npos);
}

TEST_F(ImageCacheTest, ValuesOutOfRangeAreOneSentence) {
  for (const char* bad : {"0", "-2", "1e7"}) {
    const Outcome outcome = RunSemfoam(Command(bad));
    EXPECT_EQ(outcome.exit_code, 1);
    ASSERT_THAT(outcome.Errors(), SizeIs(1));
    EXPECT_THAT(outcome.Errors()[0],
                HasSubstr("it must be a number of GB greater than 0 and up to 1000000, or -1"));
  }
  const Outcome tiny = RunSemfoam(Command("0.00001"));
  ExpectRefused(tiny, {"", {"image_cache_gb", "0.001"}, "is too little"});
}

// The probe of the effects does not need the photos in memory either.
TEST_F(ImageCacheTest, TheEffectsAreTheSame) {
  std::string report[2];
  for (int k = 0; k < 2; ++k) {
    const Outcome outcome = RunSemfoam({"scene_analyzer",
                                        "--image_path",
                                        (*folder_ / "w/images").string(),
                                        "--input_path",
                                        (*folder_ / "w/sparse/0").string(),
                                        "--output_path",
                                        (*folder_ / "effects").string(),
                                        "--image_cache_gb",
                                        k == 0 ? "10" : "0.01"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    report[k] = ReadFile(*folder_ / "effects/effects.json");
  }
  EXPECT_EQ(report[0], report[1]);
}

}  // namespace
}  // namespace semfoam
