// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/memory_plan.h"

#include "foam/util/available_memory.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int64_t kPhotoBytes = 34'000'000;
constexpr int kClasses = 13;

TrainingOptions Options(int final_sites) {
  TrainingOptions options;
  options.final_sites = final_sites;
  options.sh_degree = 3;
  return options;
}

std::string Complaint(const TrainingOptions& options, int64_t photo_bytes, int64_t available) {
  try {
    RequireMemory(options, kClasses, 5000, photo_bytes, available);
    return "";
  } catch (const UserError& error) {
    return error.what();
  }
}

TEST(MemoryPlan, AMillionSitesOfEverythingTakeLessThanThreeGigabytes) {
  const MemoryPlan plan = PlanMemory(Options(1'000'000), kClasses, 5000, kPhotoBytes);
  EXPECT_EQ(plan.sites, 1'000'000);
  EXPECT_LT(plan.Total(), 3'000'000'000);
  EXPECT_GT(plan.Total(), 2'000'000'000);
  EXPECT_THAT(plan.Report(), HasSubstr("up to 1000000 sites"));
  EXPECT_THAT(plan.Report(), HasSubstr("34 MB photos and masks"));
}

TEST(MemoryPlan, GrowsWithAllThatTakesMemory) {
  const MemoryPlan plan = PlanMemory(Options(100'000), kClasses, 5000, kPhotoBytes);
  const MemoryPlan large = PlanMemory(Options(1'000'000), kClasses, 5000, kPhotoBytes);
  TrainingOptions larger_batch = Options(1'000'000);
  larger_batch.rays_per_iteration *= 2;
  EXPECT_GT(PlanMemory(larger_batch, kClasses, 5000, kPhotoBytes).batch, 1.8 * large.batch);
  EXPECT_EQ(PlanMemory(Options(100'000), kClasses, 5000, 2 * kPhotoBytes).Total(),
            plan.Total() + kPhotoBytes);
  EXPECT_LT(PlanMemory(Options(100'000), 0, 5000, kPhotoBytes).parameters, plan.parameters);
  // The classifier with its moments, and the sums of its gradient: not one for each block of rays.
  const MemoryPlan many = PlanMemory(Options(100'000), 65'535, 5000, kPhotoBytes);
  EXPECT_GT(many.Total(), plan.Total() + 3 * 4 * 17 * 65'000);
  EXPECT_LT(many.Total(), plan.Total() + 40'000'000 + NumThreads() * 10'000'000);
  // Points may begin a run with more sites than it is to end with.
  TrainingOptions all_points = Options(100'000);
  all_points.initial_sites = 1'000'000;
  EXPECT_EQ(PlanMemory(all_points, kClasses, 1'000'000, kPhotoBytes).sites, 112'500);
}

TEST(MemoryPlan, SaysWhatIsNeededWhatThereIsAndWhatWouldFit) {
  const TrainingOptions options = Options(1'000'000);
  const int64_t needed = PlanMemory(options, kClasses, 5000, kPhotoBytes).Total();
  EXPECT_EQ(Complaint(options, kPhotoBytes, needed), "");
  EXPECT_NE(Complaint(options, kPhotoBytes, needed - 1), "");

  const std::string complaint = Complaint(options, kPhotoBytes, 1'200'000'000);
  EXPECT_THAT(complaint, HasSubstr(FormatBytes(needed)));
  EXPECT_THAT(complaint, HasSubstr("1.20 GB are available"));
  const size_t at = complaint.find("final_sites ");
  ASSERT_NE(at, std::string::npos) << complaint;
  const int would_fit = std::stoi(complaint.substr(at + 12));
  EXPECT_EQ(Complaint(Options(would_fit), kPhotoBytes, 1'200'000'000), "");
  EXPECT_NE(Complaint(Options(would_fit * 6 / 5), kPhotoBytes, 1'200'000'000), "")
      << "far less than would fit";
}

// Seven bytes a ray: a tile's place, and four pixels of five bytes.
TEST(MemoryPlan, KnowsWhatARunDraws) {
  TrainingOptions options = Options(1000);
  options.num_rays = 100'000'000;
  options.fixed_sh_degree = true;
  const int64_t bytes = DrawnPixelBytes(options);
  EXPECT_GE(bytes, 700'000'000);
  EXPECT_LE(bytes, 730'000'000);
  options.late_rays = 100'000'000;  // instead of 70
  EXPECT_EQ(DrawnPixelBytes(options) - bytes, 210'000'000);
  options.late_rays = 0;
  options.fixed_sh_degree = false;
  EXPECT_EQ(DrawnPixelBytes(options) - bytes, 140'000'000) << "from 0.2 to 0.4 of the run";
}

TEST(MemoryPlan, NamesWhatElseIsTooLarge) {
  EXPECT_THAT(Complaint(Options(1000), 8'000'000'000, 4'000'000'000), HasSubstr("image_cache_gb"));
  TrainingOptions options = Options(1000);
  options.rays_per_iteration = 1 << 24;
  EXPECT_THAT(Complaint(options, kPhotoBytes, 4'000'000'000), HasSubstr("rays_per_iteration"));
}

// A machine of files: /proc and the control groups.
class MemoryPlanAvailableTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("semfoam_memory_" + std::to_string(::getpid()));
    Write("proc/meminfo", "MemTotal: 9000 kB\nMemAvailable:    8000 kB\n");
    Write("proc/self/status", "VmSize:\t 100 kB\nVmData:\t 50 kB\n");
    Write("proc/self/cgroup", "");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  int64_t Available() const { return AvailableMemory(folder_ / "proc", folder_ / "groups"); }

  fs::path folder_;
};

TEST_F(MemoryPlanAvailableTest, IsWhatTheMachineHasLeft) { EXPECT_EQ(Available(), 8000 * 1024); }

TEST_F(MemoryPlanAvailableTest, HeedsControlGroupsOfVersion2AndThoseAbove) {
  Write("proc/self/cgroup", "0::/a/b\n");
  Write("groups/a/b/memory.max", "max\n");
  Write("groups/a/b/memory.current", "1000\n");
  EXPECT_EQ(Available(), 8000 * 1024);
  Write("groups/a/memory.max", "500000\n");
  Write("groups/a/memory.current", "200000\n");
  EXPECT_EQ(Available(), 300'000);
  Write("groups/a/memory.stat", "anon 1\ninactive_file 50000\n");
  EXPECT_EQ(Available(), 350'000) << "file cache makes way";
  Write("groups/a/b/memory.max", "1000\n");
  EXPECT_EQ(Available(), 0);
}

TEST_F(MemoryPlanAvailableTest, HeedsControlGroupsOfVersion1AlsoFromWithinAContainer) {
  Write("proc/self/cgroup", "5:cpu,cpuacct:/x\n4:memory:/outside/only\n");
  Write("groups/memory/memory.limit_in_bytes", "700000\n");
  Write("groups/memory/memory.usage_in_bytes", "300000\n");
  Write("groups/memory/memory.stat", "inactive_file 7\ntotal_inactive_file 1000\n");
  EXPECT_EQ(Available(), 401'000);
}

TEST_F(MemoryPlanAvailableTest, HeedsTheLimitsOfTheProcess) {
  for (const int resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit old;
    ASSERT_EQ(::getrlimit(resource, &old), 0);
    // More than this process has, so that it goes on (AddressSanitizer reserves 22 TB);
    // less than the machine of files has.
    Write("proc/meminfo", "MemAvailable: 90000000000 kB\n");
    rlimit limited = old;
    limited.rlim_cur = rlim_t{1} << 46;
    ASSERT_EQ(::setrlimit(resource, &limited), 0);
    const int64_t available = Available();
    ASSERT_EQ(::setrlimit(resource, &old), 0);
    EXPECT_EQ(available, (int64_t{1} << 46) - (resource == RLIMIT_AS ? 100 : 50) * 1024);
  }
}

TEST_F(MemoryPlanAvailableTest, KnowsNoLimitWhereTheSystemTellsNothing) {
  fs::remove_all(folder_ / "proc");
  EXPECT_EQ(Available(), std::numeric_limits<int64_t>::max());
}

}  // namespace
}  // namespace semfoam
