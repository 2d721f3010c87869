// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trainings in blocks on a cluster of Slurm, which tests/with_slurm makes of this machine, and with
// GNU parallel.
#include <cstdlib>
#include <string>

#include "tests/tools/block_jobs.h"
#include <gtest/gtest.h>
#include <sys/wait.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int kMissing = 77;

class SlurmTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const Outcome outcome = RunSemfoam(Splitter(Split(), "2x2", {"--polish_by_block", "1"}));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    fs::copy(Split(), *folder_ / "plain", fs::copy_options::recursive);
    for (const std::string name : {"00", "01", "02", "03"}) {
      const Outcome trained =
          RunSemfoam({"foam_trainer", "--block_path", (*folder_ / "plain" / name).string()});
      ASSERT_EQ(trained.exit_code, 0) << trained.err;
    }
    const Outcome merged = Merge(*folder_ / "plain", *folder_ / "merged");
    ASSERT_EQ(merged.exit_code, 0) << merged.err;
    foam_ = ReadFile(*folder_ / "merged/scene.foam");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static fs::path Split() { return *folder_ / "it's split"; }

  // Runs a shell script that finds `semfoam`, in $blocks, in the words of `runner`; its exit code.
  static int RunScript(const std::string& runner, const std::string& script) {
    WriteFile(*folder_ / "script",
              WithPath() + "\nset -e\nblocks=" + Quoted(Split().string()) +
                  "\noutput=" + Quoted((*folder_ / "out").string()) + "\n" + script);
    fs::remove_all(*folder_ / "out");
    for (const std::string name : {"00", "01", "02", "03"}) {
      fs::remove(Split() / name / "block.ckpt");
      fs::remove(Split() / name / "polished.foam");
    }
    const int status =
        std::system((runner + " sh " + Quoted((*folder_ / "script").string())).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  static void ExpectSameFoam() {
    EXPECT_TRUE(ReadFile(*folder_ / "out/scene.foam") == foam_) << "other bytes";
  }

  static inline TempFolder* folder_ = nullptr;
  static inline std::string foam_;
};

TEST_F(SlurmTest, ArrayJobWithARequeuedTaskEndsWithTheSameBytes) {
  const int code = RunScript(Quoted(SEMFOAM_TEST_SOURCE "/with_slurm"), R"sh(
CPUS=1 "$blocks/run_slurm.sh" "$output"
# Ends the first task that has begun to train, and lets Slurm start it again.
while [ ! -d "$blocks/00/checkpoints" ] && [ ! -e "$blocks/00/block.ckpt" ]; do sleep 0.1; done
scontrol requeue "$(squeue -h -t R -o %i | head -1)"
while [ -n "$(squeue -h)" ]; do sleep 1; done
)sh");
  if (code == kMissing) GTEST_SKIP() << "Slurm is not installed, or this is not root";
  EXPECT_EQ(code, 0);
  ExpectSameFoam();
}

TEST_F(SlurmTest, ParallelEndsWithTheSameBytes) {
  if (std::system("command -v parallel > /dev/null") != 0) {
    GTEST_SKIP() << "GNU parallel is not installed";
  }
  EXPECT_EQ(RunScript("", "JOBS=2 \"$blocks/run_parallel.sh\" \"$output\"\n"), 0);
  ExpectSameFoam();
}

}  // namespace
}  // namespace semfoam
