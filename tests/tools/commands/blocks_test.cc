// SPDX-License-Identifier: GPL-3.0-or-later
//
// scene_splitter, foam_trainer --block_path and foam_merger.
#include "foam/model/model.h"
#include "foam/train/block_checkpoint.h"
#include "tools/cli/option_manager.h"
#include "tools/options/block_options.h"

#include <algorithm>
#include <csignal>
#include <sstream>

#include "tests/tools/block_jobs.h"
#include "tests/tools/stopped_training.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class Blocks : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const Outcome outcome = RunSemfoam(Splitter(Split(), "2x2"));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    // In the order of the lines, and in the other order with other threads, one of them twice.
    fs::copy(Split(), Trained(), fs::copy_options::recursive);
    for (const std::string name : {"00", "01", "02", "03"}) TrainBlock(Trained(), name);
    const Outcome merged = Merge(Trained(), *folder_ / "merged");
    ASSERT_EQ(merged.exit_code, 0) << merged.err;
    foam_ = ReadFile(*folder_ / "merged/scene.foam");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static void TrainBlock(const fs::path& blocks,
                         const std::string& name,
                         const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"foam_trainer", "--block_path", (blocks / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(fs::exists(blocks / name / "block.ckpt"));
    EXPECT_FALSE(fs::exists(blocks / name / "checkpoints"));
  }

  // Split, and with all blocks trained; read only.
  static fs::path Split() { return *folder_ / "it's split"; }
  static fs::path Trained() { return *folder_ / "trained"; }
  // A copy of the latter, to be spoilt.
  static fs::path CopyOfTrained(const std::string& name) {
    const fs::path copy = *folder_ / name;
    fs::copy(Trained(), copy, fs::copy_options::recursive);
    return copy;
  }
  static void ExpectMergeRefused(const fs::path& blocks, const Mistake& mistake) {
    const fs::path output = *folder_ / "refused";
    ExpectRefused(Merge(blocks, output), mistake);
    EXPECT_THAT(FilesBelow(output), IsEmpty());
  }

  static inline TempFolder* folder_ = nullptr;
  static inline std::string foam_;
};

TEST_F(Blocks, JobsRunInAnyOrderAndAgainToTheSameBytes) {
  std::vector<std::string> jobs = JobsOf(Split());
  ASSERT_EQ(jobs.size(), 4u);
  std::reverse(jobs.begin(), jobs.end());
  for (const std::string& job : jobs) {
    EXPECT_EQ(job.rfind("semfoam foam_trainer --block_path ", 0), 0u) << job;
    EXPECT_EQ(RunJob(job + " --num_threads 1"), 0) << job;
  }
  TrainBlock(Split(), "02");
  TrainBlock(Split(), "01", {"--overwrite", "1", "--num_threads", "3"});
  const Outcome merged = Merge(Split(), *folder_ / "merged again");
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_TRUE(ReadFile(*folder_ / "merged again/scene.foam") == foam_) << "other bytes";
}

// Seeds, distances and sky of the sweep are those that the split has found.
TEST_F(Blocks, UntrainedMakeTheFoamOfOneTraining) {
  const fs::path blocks = *folder_ / "untrained", one = *folder_ / "one";
  const std::string sweep = "--FoamTraining.sweep_photos";
  const Outcome split = RunSemfoam(
      Splitter(blocks, "2x1", {"--coarse_share", "0.5", "--polish_share", "0.5", sweep, "8"}));
  ASSERT_EQ(split.exit_code, 0) << split.err;
  for (const std::string name : {"00", "01"}) TrainBlock(blocks, name);
  const Outcome merged = Merge(blocks, *folder_ / "of untrained");
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  const Outcome trained =
      RunSemfoam(TinyTraining(TrainerOn(kTabletop, one, {"--test_every", "8", sweep, "8"})));
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  for (const char* file : {"scene.foam", "labels.json", "effects.json"}) {
    EXPECT_TRUE(ReadFile(*folder_ / "of untrained" / file) == ReadFile(one / file)) << file;
  }
  EXPECT_THAT(merged.err, HasSubstr("Plane sweep: "));
  fs::remove(blocks / "sweep.ckpt");
  ExpectMergeRefused(blocks, {"sweep.ckpt", {}, "older version"});
}

TEST_F(Blocks, KilledBlockGoesOnToTheSameBytes) {
  const fs::path blocks = CopyOfTrained("killed");
  fs::remove(blocks / "01/block.ckpt");
  Running running(
      {"foam_trainer", "--block_path", (blocks / "01").string(), "--checkpoint_every", "0.001"});
  ASSERT_TRUE(running.WaitUntil([&] { return CheckpointsIn(blocks / "01").size() == 2; }));
  EXPECT_EQ(running.End(SIGKILL).exit_code, 128 + SIGKILL);
  const Outcome missing = Merge(blocks, *folder_ / "refused");
  ExpectRefused(missing, {"01/block.ckpt", {}, "not trained"});
  const Outcome again = RunSemfoam({"foam_trainer", "--block_path", (blocks / "01").string()});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("Going on from"));
  const Outcome merged = Merge(blocks, *folder_ / "merged of killed");
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_TRUE(ReadFile(*folder_ / "merged of killed/scene.foam") == foam_) << "other bytes";
}

// The sites around a block count as far as its rays meet them.
TEST_F(Blocks, AreAsManyAsMaxSitesTakes) {
  const auto most_sites = [](const fs::path& blocks) {
    int64_t most = 0;
    const auto json = nlohmann::json::parse(ReadFile(blocks / "blocks.json"));
    for (const auto& block : json["blocks"]) most = std::max(most, block["sites"].get<int64_t>());
    return most;
  };
  const int64_t of_four = most_sites(Split());
  const fs::path blocks = *folder_ / "by sites", refused = *folder_ / "by too few sites";
  const Outcome split = RunSemfoam(Splitter(blocks, "", {"--max_sites", std::to_string(of_four)}));
  ASSERT_EQ(split.exit_code, 0) << split.err;
  EXPECT_LE(most_sites(blocks), of_four);
  EXPECT_GE(JobsOf(blocks).size(), 2u);
  EXPECT_LE(JobsOf(blocks).size(), 5u);
  const Outcome too_few = RunSemfoam(Splitter(refused, "", {"--max_sites", "100"}));
  EXPECT_EQ(too_few.exit_code, 1);
  EXPECT_THAT(too_few.err, HasSubstr("--max_sites is 100, and with up to"));
  EXPECT_FALSE(fs::exists(refused / "blocks.json"));
}

// Blocks of a coarse foam bring its sites to those of the run, in any order and on any threads.
TEST_F(Blocks, AddSitesToACoarseFoam) {
  const fs::path blocks = *folder_ / "coarse", again = *folder_ / "coarse again";
  const std::vector<std::string> options = {
      "--coarse_sites", "1000", "--FoamTraining.sweep_photos", "8"};
  const Outcome split = RunSemfoam(Splitter(blocks, "2x1", options));
  ASSERT_EQ(split.exit_code, 0) << split.err;
  EXPECT_THAT(split.err, HasSubstr("up to 1000 sites"));
  const size_t num_coarse = FoamOf(Checkpoint(blocks / "split.ckpt")).NumSites();
  EXPECT_LT(num_coarse, 1500u);
  fs::copy(blocks, again, fs::copy_options::recursive);
  for (const std::string name : {"00", "01"}) TrainBlock(blocks, name);
  for (const std::string name : {"01", "00"}) TrainBlock(again, name, {"--num_threads", "1"});
  size_t num_sites = 0;
  for (const std::string name : {"00", "01"}) {
    const Foam foam = FoamOfBlock(Checkpoint(blocks / name / "block.ckpt"));
    num_sites += foam.NumSites();
  }
  EXPECT_GT(num_sites, 3200u);
  EXPECT_LT(num_sites, 4800u);
  const Outcome merged = Merge(blocks, *folder_ / "refined");
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  const Outcome merged_again = Merge(again, *folder_ / "refined again");
  ASSERT_EQ(merged_again.exit_code, 0) << merged_again.err;
  EXPECT_TRUE(ReadFile(*folder_ / "refined/scene.foam") ==
              ReadFile(*folder_ / "refined again/scene.foam"))
      << "other bytes";
}

// Each is polished by a job of its own, or by the merge; in any order, stopped or not.
TEST_F(Blocks, ArePolishedOneByOne) {
  const fs::path blocks = *folder_ / "polished", again = *folder_ / "polished again";
  const Outcome split = RunSemfoam(Splitter(blocks, "2x1", {"--polish_by_block", "1"}));
  ASSERT_EQ(split.exit_code, 0) << split.err;
  EXPECT_THAT(split.err, HasSubstr("polish_jobs.txt"));
  TrainBlock(blocks, "00");
  const auto polish = [](const fs::path& block) {
    return RunSemfoam({"foam_trainer", "--block_path", block.string(), "--polish", "1"});
  };
  ExpectRefused(polish(blocks / "00"), {"01/block.ckpt", {}, "not trained"});
  ExpectRefused(polish(Trained() / "00"), {"blocks.json", {"polish_by_block"}, "all together"});
  TrainBlock(blocks, "01");
  fs::copy(blocks, again, fs::copy_options::recursive);
  const Outcome merged = Merge(blocks, *folder_ / "of polished");
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_THAT(merged.err, HasSubstr("01 is polished."));
  const Model foam = ReadModel(*folder_ / "of polished/scene.foam");
  const Model one = ReadModel(*folder_ / "merged/scene.foam");
  EXPECT_EQ(foam.options, one.options);
  EXPECT_EQ(foam.photos.size(), one.photos.size());
  EXPECT_EQ(foam.statistics.passed.size(), foam.foam.NumSites());
  EXPECT_NEAR(double(foam.foam.NumSites()), double(one.foam.NumSites()), 200);
  for (const char* file : {"effects.json", "labels.json", "training_log.csv"}) {
    EXPECT_TRUE(fs::exists(*folder_ / "of polished" / file)) << file;
  }

  // By jobs, the other block first; one is killed.
  std::istringstream lines(ReadFile(again / "polish_jobs.txt"));
  std::vector<std::string> jobs;
  for (std::string line; std::getline(lines, line);) jobs.push_back(line);
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_THAT(jobs[1], HasSubstr(" --polish 1"));
  Running running({"foam_trainer",
                   "--block_path",
                   (again / "01").string(),
                   "--polish",
                   "1",
                   "--checkpoint_every",
                   "0.001",
                   "--num_threads",
                   "1"});
  ASSERT_TRUE(running.WaitUntil([&] { return CheckpointsIn(again / "01").size() == 2; }));
  EXPECT_EQ(running.End(SIGKILL).exit_code, 128 + SIGKILL);
  for (const char* name : {"01", "00"}) {
    const Outcome polished = polish(again / name);
    EXPECT_EQ(polished.exit_code, 0) << polished.err;
  }
  const Outcome merged_again = Merge(again, *folder_ / "of polished again");
  ASSERT_EQ(merged_again.exit_code, 0) << merged_again.err;
  for (const char* file : {"scene.foam", "labels.json", "effects.json"}) {
    EXPECT_TRUE(ReadFile(*folder_ / "of polished" / file) ==
                ReadFile(*folder_ / "of polished again" / file))
        << file;
  }

  fs::copy_file(
      again / "00/polished.foam", again / "01/polished.foam", fs::copy_options::overwrite_existing);
  ExpectMergeRefused(again, {"01/polished.foam", {"01"}, "not of block 01"});
}

// As if the splitter had been killed right after it wrote blocks.json.
TEST_F(Blocks, SplitGoesOnWhereItsJobsAreMissing) {
  const fs::path blocks = CopyOfTrained("without jobs");
  for (const char* file : {"jobs.txt", "run_parallel.sh", "run_slurm.sh"}) {
    fs::remove(blocks / file);
  }
  const std::string record = ReadFile(blocks / "blocks.json");
  const Outcome again = RunSemfoam(Splitter(blocks, "2x2", {"--resume", "1"}));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("is split already"));
  EXPECT_EQ(ReadFile(blocks / "blocks.json"), record);
  EXPECT_EQ(JobsOf(blocks).size(), 4u);
  EXPECT_THAT(JobsOf(blocks)[2], HasSubstr((blocks / "02").string()));
  for (const char* file : {"run_parallel.sh", "run_slurm.sh"}) {
    EXPECT_EQ(ReadFile(blocks / file), ReadFile(Split() / file)) << file;
  }
}

// A held-out photo belongs to no block; it is damaged behind its header.
TEST_F(Blocks, ReadTheirOwnPhotosAlone) {
  const fs::path workspace = *folder_ / "workspace", blocks = *folder_ / "of a copy";
  CopyTabletop(workspace);
  const Outcome split = RunSemfoam(Splitter(blocks, "2x2", {}, workspace));
  ASSERT_EQ(split.exit_code, 0) << split.err;
  const auto json = nlohmann::json::parse(ReadFile(blocks / "blocks.json"));
  const std::string held_out = "0000.jpg", own = json["blocks"][1]["photos"][0];
  for (const auto& block : json["blocks"]) {
    for (const std::string photo : block["photos"]) EXPECT_NE(photo, held_out);
  }
  const std::string bytes = ReadFile(workspace / "images" / held_out);
  WriteFile(workspace / "images" / held_out, bytes.substr(0, bytes.size() / 2));
  TrainBlock(blocks, "01");
  const Foam foam = FoamOfBlock(Checkpoint(blocks / "01/block.ckpt"));
  const Foam expected = FoamOfBlock(Checkpoint(Trained() / "01/block.ckpt"));
  EXPECT_EQ(foam.positions, expected.positions);
  EXPECT_EQ(foam.sh, expected.sh);
  EXPECT_EQ(foam.identity, expected.identity);

  fs::remove(blocks / "01/block.ckpt");
  WriteFile(workspace / "images" / own, bytes);
  const auto train = [&] {
    return RunSemfoam({"foam_trainer", "--block_path", (blocks / "01").string()});
  };
  ExpectRefused(train(), {"start.ckpt", {}, "photos"});
  const std::string known = ReadFile(blocks / "photos.ckpt");
  WriteFile(blocks / "photos.ckpt", known.substr(0, known.size() / 2));
  ExpectRefused(train(), {"photos.ckpt", {}, "a new split"});
  fs::remove(blocks / "photos.ckpt");
  ExpectRefused(train(), {"photos.ckpt", {}, "older version"});
  EXPECT_FALSE(fs::exists(blocks / "01/block.ckpt"));
}

TEST_F(Blocks, MergeRefusesWhatIsMissingCutForeignOrOlder) {
  {
    const fs::path blocks = CopyOfTrained("missing");
    fs::remove(blocks / "02/block.ckpt");
    ExpectMergeRefused(blocks, {"02/block.ckpt", {}, "not trained"});
  }
  {
    const fs::path blocks = CopyOfTrained("cut");
    const std::string bytes = ReadFile(blocks / "02/block.ckpt");
    WriteFile(blocks / "02/block.ckpt", bytes.substr(0, bytes.size() / 2));
    ExpectMergeRefused(blocks, {"02/block.ckpt", {}, "cut or damaged"});
  }
  {
    const fs::path blocks = CopyOfTrained("swapped");
    fs::copy_file(
        blocks / "01/block.ckpt", blocks / "02/block.ckpt", fs::copy_options::overwrite_existing);
    ExpectMergeRefused(blocks, {"02/block.ckpt", {"01", "02"}, "of block 01"});
  }
  {
    const fs::path blocks = *folder_ / "of another split";
    const Outcome split =
        RunSemfoam(Splitter(blocks, "1x2", {"--coarse_share", "0.4", "--polish_share", "0.6"}));
    ASSERT_EQ(split.exit_code, 0) << split.err;
    for (const std::string name : {"00", "01"}) TrainBlock(blocks, name);
    fs::copy_file(Trained() / "01/block.ckpt",
                  blocks / "01/block.ckpt",
                  fs::copy_options::overwrite_existing);
    ExpectMergeRefused(blocks, {"01/block.ckpt", {}, "another split"});
  }
  {
    const fs::path blocks = CopyOfTrained("older");
    std::string json = ReadFile(blocks / "blocks.json");
    const std::string version = "\"version\": 2";
    json.replace(json.find(version), version.size(), "\"version\": 1");
    WriteFile(blocks / "blocks.json", json);
    ExpectMergeRefused(blocks, {"blocks.json", {"1", "2"}, "version"});
    fs::remove(blocks / "01/block.ckpt");
    ExpectRefused(RunSemfoam({"foam_trainer", "--block_path", (blocks / "01").string()}),
                  {"blocks.json", {"1", "2"}, "version"});
  }
  ExpectMergeRefused(*folder_ / "no blocks", {"blocks.json", {}, "no such file"});
}

TEST_F(Blocks, OptionsThatSayNothingAreRefused) {
  const fs::path output = *folder_ / "refused";
  ExpectRefused(RunSemfoam(Splitter(output, "2by2")), {"", {"blocks", "2by2"}, "3x2"});
  ExpectRefused(RunSemfoam(Splitter(output, "0x2")), {"", {"blocks", "0x2"}, "from 1x1"});
  ExpectRefused(RunSemfoam(Splitter(output, "2x2", {"--max_sites", "1000"})),
                {"", {"blocks", "max_sites"}, "one of them"});
  ExpectRefused(RunSemfoam(Splitter(output, "2x2", {"--coarse_sites", "5"})),
                {"", {"coarse_sites", "5"}, "at least 64"});
  ExpectRefused(RunSemfoam(Splitter(output, "2x2", {"--coarse_sites", "4000"})),
                {"", {"coarse_sites", "4000", "final_sites"}, "less than that"});
  ExpectRefused(RunSemfoam(Splitter(
                    output, "2x2", {"--coarse_sites", "1000", "--FoamTraining.late_rays", "9999"})),
                {"", {"late_rays", "9999"}, "0 would be right"});
  ExpectRefused(RunSemfoam(Splitter(output, "2x2", {"--polish_by_block", "2"})),
                {"", {"polish_by_block", "2"}, "0, 1 or -1"});
  ExpectRefused(RunSemfoam(Splitter(output, "2x2", {"--coarse_share", "0.95"})),
                {"", {"polish_share", "0.2"}, "at most 1"});
  ExpectRefused(RunSemfoam({"scene_splitter",
                            "--workspace_path",
                            kTabletop.string(),
                            "--output_path",
                            output.string(),
                            "--blocks",
                            "2x2",
                            "--FoamTraining.time_budget",
                            "20"}),
                {"", {"time_budget", "20"}, "fixed numbers"});
  EXPECT_THAT(FilesBelow(output), IsEmpty());
  ExpectRefused(RunSemfoam(Splitter(Split(), "2x2")), {"blocks.json", {}, "holds a split"});
  ExpectRefused(
      RunSemfoam(
          {"foam_trainer", "--block_path", (Trained() / "01").string(), "--quality", "medium"}),
      {"", {"quality"}, "no effect"});
  ExpectRefused(RunSemfoam({"foam_trainer", "--block_path", (Trained() / "07").string()}),
                {"07", {"00", "03"}, "no block"});
  ExpectRefused(RunSemfoam({"foam_trainer", "--block_path", (*folder_ / "nowhere/03").string()}),
                {"nowhere", {}, "no split of a run"});
}

// What scene_splitter makes of options besides the workspace and --blocks.
SplitOptions SplitOf(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(),
                   {"scene_splitter", "--workspace_path", kTabletop.string(), "--blocks", "2x2"});
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  BlockRunOptions run;
  OptionManager options("scene_splitter", "");
  AddBlockRunOptions(&options, &run);
  EXPECT_TRUE(options.Parse(static_cast<int>(argv.size()), argv.data()));
  FinishBlockRun(options, &run);
  return run.split;
}

TEST(BlockOptions, SplitLargeFoamsWhileTheyAreCoarse) {
  const SplitOptions large = SplitOf({"--final_sites", "400000"});
  EXPECT_EQ(large.coarse_sites, 50000);
  EXPECT_EQ(large.coarse_share, 0.1);
  const SplitOptions small = SplitOf({"--final_sites", "200000"});
  EXPECT_EQ(small.coarse_sites, 0);
  EXPECT_EQ(small.coarse_share, 0.3);
  // Its schedule has no room for the blocks' densification.
  const SplitOptions late = SplitOf({"--final_sites", "400000", "--FoamTraining.late_rays", "1M"});
  EXPECT_EQ(late.coarse_sites, 0);
  const SplitOptions given =
      SplitOf({"--final_sites", "400000", "--coarse_sites", "1000", "--coarse_share", "0.2"});
  EXPECT_EQ(given.coarse_sites, 1000);
  EXPECT_EQ(given.coarse_share, 0.2);
  EXPECT_EQ(SplitOf({"--final_sites", "400000", "--coarse_sites", "0"}).coarse_share, 0.3);
}

}  // namespace
}  // namespace semfoam
