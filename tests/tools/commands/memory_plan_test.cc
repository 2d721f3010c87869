// SPDX-License-Identifier: GPL-3.0-or-later
//
// The plan of memory that a training prints, against the peak that is measured, for every way in
// which photos and masks are read.
#include "plugin/mask/label_png.h"
#include "tools/images/image_files.h"

#include <cstdio>
#include <memory>

#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include "tests/tools/ring_capture.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The peak may be above the plan by this share, and the plan above the peak by that.
constexpr double kMostAbovePlan = 0.05;
constexpr double kMostBelowPlan = 0.5;

class MemoryPlanTest : public testing::Test {
 protected:
  void SetUp() override {
    if (kReservedBySanitizer > 0) GTEST_SKIP() << "sanitizers take memory of their own";
  }
  static void SetUpTestSuite() { folder_ = std::make_unique<TempFolder>(); }
  static void TearDownTestSuite() { folder_.reset(); }

  // A capture of 50 photos of width x height whose masks are those of a capture `mask_scale` times
  // as large. Made once.
  static fs::path Workspace(int width, int height, int mask_scale = 1) {
    const std::string name = std::to_string(width) + "_" + std::to_string(mask_scale);
    const fs::path workspace = *folder_ / name;
    if (fs::exists(workspace)) return workspace;
    const RingCapture capture(workspace, 50, width, height);
    if (mask_scale == 1) return workspace;
    fs::remove_all(workspace / "object_mask");
    const RingCapture large(*folder_ / "large", 50, mask_scale * width, mask_scale * height);
    fs::rename(*folder_ / "large/object_mask", workspace / "object_mask");
    fs::remove_all(*folder_ / "large");
    return workspace;
  }

  // Trains, and holds the plan's bytes against the peak's.
  static void ExpectPlanned(const std::string& what,
                            const fs::path& workspace,
                            const std::vector<std::string>& options) {
    const fs::path output = *folder_ / "out";
    std::vector<std::string> command =
        TrainerOn(workspace,
                  output,
                  {"--FoamTraining.num_rays", "20000", "--FoamTraining.final_sites", "2000"});
    command.insert(command.end(), options.begin(), options.end());
    const MeasuredRun run = MeasureSemfoam(TinyTraining(command));
    fs::remove_all(output);
    EXPECT_EQ(run.outcome.exit_code, 0) << run.outcome.err;
    const double plan = LastBytesBefore(run.outcome.err, "in all");
    const auto peak = static_cast<double>(run.peak_bytes);
    std::printf("%-40s plan %4.0f MB, peak %4.0f MB: %.2f\n",
                what.c_str(),
                plan / 1e6,
                peak / 1e6,
                plan / peak);
    std::fflush(stdout);
    EXPECT_LT(peak, (1 + kMostAbovePlan) * plan) << what;
    EXPECT_LT(plan, (1 + kMostBelowPlan) * peak) << what;
  }

  static std::unique_ptr<TempFolder> folder_;
};

std::unique_ptr<TempFolder> MemoryPlanTest::folder_;

TEST_F(MemoryPlanTest, Held) {
  const fs::path workspace = Workspace(640, 480);
  ExpectPlanned("held", workspace, {"--image_cache_gb", "10"});
}

TEST_F(MemoryPlanTest, Streamed) {
  const fs::path workspace = Workspace(320, 240);
  ExpectPlanned("streamed", workspace, {"--image_cache_gb", "0.01"});
  ExpectPlanned("streamed in chapters", workspace, {"--image_cache_gb", "0.001"});
}

TEST_F(MemoryPlanTest, Reduced) {
  const fs::path workspace = Workspace(1600, 1200);
  ExpectPlanned(
      "reduced, held", workspace, {"--FoamTraining.max_image_size", "80", "--num_threads", "8"});
  ExpectPlanned(
      "reduced, streamed",
      workspace,
      {"--FoamTraining.max_image_size", "80", "--num_threads", "8", "--image_cache_gb", "0.0009"});
}

TEST_F(MemoryPlanTest, LargerMasks) {
  const fs::path workspace = Workspace(320, 240, /*mask_scale=*/8);
  ExpectPlanned("masks 8 times larger, held", workspace, {"--FoamTraining.max_image_size", "80"});
  ExpectPlanned("masks 8 times larger, streamed",
                workspace,
                {"--FoamTraining.max_image_size", "80", "--image_cache_gb", "0.0009"});
}

// Thousands of ids, and a sum of the classifier's gradient for each of a batch's blocks of rays.
TEST_F(MemoryPlanTest, ManyLabels) {
  const fs::path workspace = *folder_ / "labels";
  fs::copy(Workspace(320, 240), workspace, fs::copy_options::recursive);
  LabelImage ids{320, 240, std::vector<int32_t>(320 * 240)};
  for (int i = 0; i < 320 * 240; ++i) ids.data[i] = 1 + i % 320 / 4 + 80 * (i / 320 / 4);
  for (const auto& mask : fs::directory_iterator(workspace / "object_mask")) {
    fs::remove(mask.path());
    WriteLabelPng(mask.path(), ids);
  }
  ExpectPlanned("4800 labels",
                workspace,
                {"--Masks.consistency", "off", "--FoamTraining.rays_per_iteration", "4096"});
}

// The header of a photo that is whole as far as can be told without decoding it.
TEST_F(MemoryPlanTest, APhotoThatTheMemoryCannotHoldIsNamed) {
  const fs::path workspace = *folder_ / "huge";
  fs::copy(Workspace(320, 240), workspace, fs::copy_options::recursive);
  const fs::path photo = workspace / "images/000_07.jpg";
  fs::remove(photo);
  const auto write_header = [&](uint32_t width, uint32_t height) {
    std::string png = "\x89PNG\r\n\x1a\n";
    std::string header = "IHDR";
    for (const uint32_t side : {width, height}) {
      for (int shift = 24; shift >= 0; shift -= 8) header += static_cast<char>(side >> shift);
    }
    header += std::string("\x08\x00\x00\x00\x00", 5);
    const uLong checksum =
        crc32(0, reinterpret_cast<const Bytef*>(header.data()), static_cast<uInt>(header.size()));
    png += std::string("\x00\x00\x00\x0d", 4) + header;
    for (int shift = 24; shift >= 0; shift -= 8) png += static_cast<char>(checksum >> shift);
    // Pixels of one colour take so little.
    WriteFile(photo, png + std::string("\x00\x70\x00\x00IDAT", 8) + std::string(7 << 20, 0));
  };
  const std::vector<std::string> command = TinyTraining({"foam_trainer",
                                                         "--image_path",
                                                         (workspace / "images").string(),
                                                         "--input_path",
                                                         (workspace / "sparse/0").string(),
                                                         "--output_path",
                                                         (*folder_ / "out").string()});
  write_header(100'000, 75'000);
  const MeasuredRun run = MeasureSemfoam(command, /*memory_limit=*/int64_t{1} << 30);
  ExpectRefused(run.outcome,
                {photo.string(), {"100000 x 75000 pixels", "30.00 GB"}, "of memory to decode"});
  EXPECT_LT(run.peak_bytes, 250'000'000);
  write_header(400'000, 300'000);
  ExpectRefused(RunSemfoam(command),
                {photo.string(),
                 {"400000 x 300000 pixels", std::to_string(fs::file_size(photo)) + " bytes"},
                 "claims"});
}

}  // namespace
}  // namespace semfoam
