// SPDX-License-Identifier: GPL-3.0-or-later
//
// The program is stopped in the midst of its work, by what stops programs, and goes on.
#include <algorithm>
#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/stopped_training.h"

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Resume = StoppedTraining;

TEST_F(Resume, TheCommandThatASignalLeavesGoesOn) {
  for (const auto& [signal, exit_code] : {std::pair(SIGINT, 130), std::pair(SIGTERM, 143)}) {
    const TempFolder folder;
    const fs::path output = folder / "it's \"out\"";
    const Outcome stopped = TrainAndStop(Workspace(), output, signal);
    EXPECT_EQ(stopped.exit_code, exit_code);
    EXPECT_THAT(stopped.Errors(), IsEmpty());
    const auto checkpoints = CheckpointsIn(output);
    ASSERT_EQ(checkpoints.size(), 2u);
    EXPECT_THAT(stopped.err,
                HasSubstr("Stopped after iteration " + checkpoints.back().stem().string() + "."));
    EXPECT_EQ(FilesBelow(output).size(), 2u);

    // The command, as it stands there, pasted into a shell.
    const std::string before = "To go on from there: ";
    const size_t at = stopped.err.find(before);
    ASSERT_NE(at, std::string::npos) << stopped.err;
    WriteFile(folder / "command", stopped.err.substr(at + before.size()));
    const Outcome resumed = RunProgram("/bin/sh", {(folder / "command").string()});
    EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_THAT(resumed.err, HasSubstr("Going on from " + checkpoints.back().string()));
    ExpectWhole(output);
  }
}

TEST_F(Resume, GoesOnAfterKillOnAnotherNumberOfThreads) {
  const TempFolder folder;
  for (const char* threads : {"1", "5"}) {
    const fs::path output = folder / threads;
    CopyStopped(output);
    fs::create_directory(output / "checkpoints" / ".semfoam-tmp-1-0");  // of the killed process
    const Outcome resumed =
        RunSemfoam(Trainer(Workspace(), output, {"--resume", "1", "--num_threads", threads}));
    EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_THAT(resumed.err, HasSubstr("Going on from"));
    ExpectWhole(output);
  }
}

TEST_F(Resume, TakesTheCheckpointBeforeADamagedOne) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  auto checkpoints = CheckpointsIn(output);
  ASSERT_GE(checkpoints.size(), 2u);
  fs::resize_file(checkpoints.back(), fs::file_size(checkpoints.back()) - 100);
  Outcome resumed = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err,
              HasSubstr("WARNING: " + checkpoints.back().string() + ": this checkpoint is cut"));
  checkpoints.pop_back();
  EXPECT_THAT(resumed.err, HasSubstr("Going on from " + checkpoints.back().string()));
  ExpectWhole(output);
}

TEST_F(Resume, BeginsAnewWhereNoCheckpointCanBeRead) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  for (const fs::path& path : CheckpointsIn(output)) WriteFile(path, "no checkpoint");
  const Outcome resumed = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("There is no checkpoint to go on from"));
  ExpectWhole(output);
}

TEST_F(Resume, ARunFromTheBeginningKeepsTheOldCheckpointsUntilItsEnd) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  const auto old = CheckpointsIn(output);
  const Outcome stopped = TrainAndStop(Workspace(), output, SIGINT);
  EXPECT_THAT(stopped.err, HasSubstr("that resume 1 would have gone on with"));
  for (const fs::path& path : old) {
    EXPECT_TRUE(fs::exists(output / "checkpoints" / "replaced" / path.filename())) << path;
  }
  const Outcome resumed = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  ExpectWhole(output);
}

TEST_F(Resume, OnAFinishedFolderDoesNothingAndSaysSo) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  fs::copy(Whole(), output, fs::copy_options::recursive);
  const auto time = fs::last_write_time(output / "scene.foam");
  const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("is finished"));
  EXPECT_EQ(fs::last_write_time(output / "scene.foam"), time);
  ExpectWhole(output);
}

TEST_F(Resume, WithoutCheckpointBeginsAtTheBeginningAndSaysSo) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("There is no checkpoint to go on from"));
  ExpectWhole(output);
}

TEST_F(Resume, AnExportThatIsStoppedGoesOnWithoutTraining) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  std::vector<std::string> segmenter = Trainer(Workspace(), output, {"--formats", "vdb,ply"});
  segmenter[0] = "automatic_segmenter";
  segmenter.insert(segmenter.end(), {"--workspace_path", Workspace().string()});
  {
    Running running(segmenter);
    ASSERT_TRUE(running.WaitUntil([&] {
      return fs::exists(output / "checkpoints/trained.ckpt") && CheckpointsIn(output).empty();
    }));
    running.End(SIGKILL);
  }
  EXPECT_FALSE(fs::exists(output / "scene.vdb")) << "too late to be a test";
  EXPECT_THAT(CheckpointsIn(output), IsEmpty());
  const auto time = fs::last_write_time(output / "scene.foam");
  segmenter.insert(segmenter.end(), {"--resume", "1"});
  const Outcome resumed = RunSemfoam(segmenter);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("Training is done already"));
  EXPECT_EQ(fs::last_write_time(output / "scene.foam"), time);
  EXPECT_TRUE(ReadFile(output / "scene.foam") == foam_);
  EXPECT_TRUE(fs::exists(output / "scene.vdb"));
  EXPECT_FALSE(fs::exists(output / "checkpoints"));
}

// What is left to do after training is one command as well, which trains nothing.
TEST_F(Resume, TheCommandThatASignalLeavesAfterTrainingExports) {
  const TempFolder folder;
  const fs::path output = folder / "it's \"out\"";
  std::vector<std::string> segmenter = Trainer(Workspace(), output, {"--formats", "vdb,ply"});
  segmenter[0] = "automatic_segmenter";
  segmenter.insert(segmenter.end(), {"--workspace_path", Workspace().string()});
  Outcome stopped;
  {
    Running running(segmenter);
    ASSERT_TRUE(running.WaitUntil([&] { return fs::exists(output / "objects"); }));
    stopped = running.End(SIGINT);
  }
  EXPECT_EQ(stopped.exit_code, 130);
  EXPECT_FALSE(fs::exists(output / "labels.json")) << "too late to be a test";
  const std::string before = "WARNING: Stopped after training. To go on from there: ";
  const size_t at = stopped.err.find(before);
  ASSERT_NE(at, std::string::npos) << stopped.err;
  WriteFile(folder / "command", stopped.err.substr(at + before.size()));
  const Outcome resumed = RunProgram("/bin/sh", {(folder / "command").string()});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("Training is done already"));
  EXPECT_THAT(resumed.err, Not(HasSubstr("iteration ")));

  segmenter[std::find(segmenter.begin(), segmenter.end(), output.string()) - segmenter.begin()] =
      (folder / "whole").string();
  ASSERT_EQ(RunSemfoam(segmenter).exit_code, 0);
  const auto files = FilesBelow(folder / "whole");
  EXPECT_THAT(FilesBelow(output), ::testing::UnorderedElementsAreArray(files));
  for (const std::string& file : files) {
    if (file.starts_with("training_") || file == "report.html") continue;  // times
    EXPECT_TRUE(ReadFile(output / file) == ReadFile(folder / "whole" / file)) << file;
  }
}

TEST_F(Resume, KeepsTheScheduleOfATimeBudget) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  std::vector<std::string> budget = {"foam_trainer",
                                     "--image_path",
                                     (Workspace() / "images").string(),
                                     "--input_path",
                                     (Workspace() / "sparse/0").string(),
                                     "--output_path",
                                     output.string(),
                                     "--FoamTraining.time_budget"};
  // Where measuring the machine takes all of it, as with sanitizers, there is nothing to stop.
  const auto is_stopped = [&](const char* seconds) {
    fs::remove_all(output);
    std::vector<std::string> first = budget;
    first.insert(first.end(), {seconds, "--checkpoint_every", "0.001"});
    Running running(first);
    if (!running.WaitUntil([&] { return CheckpointsIn(output).size() == 2; })) return false;
    running.End(SIGKILL);
    budget.push_back(seconds);
    return true;
  };
  ASSERT_TRUE(is_stopped("12") || is_stopped("60") || is_stopped("240"));
  std::vector<std::string> again = budget;
  again.insert(again.end(), {"--resume", "1"});
  const Outcome resumed = RunSemfoam(again);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("Going on from"));
  EXPECT_THAT(resumed.err, Not(HasSubstr("into measuring this machine")));
  // The schedule that is printed at the end makes the same foam.
  const size_t at = resumed.err.find("--FoamTraining.num_rays");
  ASSERT_NE(at, std::string::npos) << resumed.err;
  std::istringstream line(resumed.err.substr(at, resumed.err.find('\n', at) - at));
  std::vector<std::string> same(budget.begin(), budget.begin() + 5);
  same.insert(same.end(), {"--output_path", (folder / "same").string()});
  for (std::string word; line >> word;) same.push_back(word);
  const Outcome repeated = RunSemfoam(same);
  EXPECT_EQ(repeated.exit_code, 0) << repeated.err;
  EXPECT_TRUE(ReadFile(folder / "same" / "scene.foam") == ReadFile(output / "scene.foam"));
}

}  // namespace
}  // namespace semfoam
