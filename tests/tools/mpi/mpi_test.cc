// SPDX-License-Identifier: GPL-3.0-or-later
//
// One foam trained by several processes, which mpirun starts, in builds with MPI.
#include <algorithm>
#include <csignal>
#include <fstream>
#include <string>
#include <vector>

#include "tests/tools/stopped_training.h"

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// As root too, on more ranks than cores, with the time to write a checkpoint.
std::vector<std::string> MpirunOptions() {
  return {"--allow-run-as-root", "--oversubscribe", "--mca", "odls_base_sigkill_timeout", "10"};
}

std::vector<std::string> Joined(std::vector<std::string> words,
                                const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// The arguments of mpirun for the program on so many ranks.
std::vector<std::string> OnRanks(int num_ranks, const std::vector<std::string>& arguments) {
  return Joined(Joined(MpirunOptions(), {"-n", std::to_string(num_ranks), SEMFOAM_PROGRAM}),
                Joined(arguments, {"--mpi", "1", "--num_threads", "1"}));
}

// The process of a rank among the children of mpirun.
pid_t ProcessOf(pid_t mpirun, int rank) {
  const std::string process = std::to_string(mpirun);
  std::ifstream children("/proc/" + process + "/task/" + process + "/children");
  for (pid_t child = 0; children >> child;) {
    const std::string environment = ReadFile("/proc/" + std::to_string(child) + "/environ");
    const std::string variable = "OMPI_COMM_WORLD_RANK=" + std::to_string(rank);
    if (environment.find(variable + '\0') != std::string::npos) return child;
  }
  ADD_FAILURE() << "no rank " << rank;
  return 0;
}

class MpiTest : public StoppedTraining {
 protected:
  // Trains on two ranks until there are checkpoints, and sends one of them a signal. Returns what
  // mpirun and they wrote.
  static Outcome TrainAndSignal(const fs::path& output, int rank, int signal) {
    Running running(OnRanks(2, SavingTrainer(Workspace(), output)), SEMFOAM_MPIRUN);
    EXPECT_TRUE(running.WaitUntil([&] {
      const auto checkpoints = CheckpointsIn(output);
      return checkpoints.size() == 2 && std::stoi(checkpoints.back().stem().string()) >= 20;
    })) << "it ended before it could be stopped";
    ::kill(ProcessOf(running.process(), rank), signal);
    return running.Wait();
  }

  // Goes on alone and on several ranks.
  static void ExpectGoesOn(const fs::path& output) {
    const fs::path copy = output.parent_path() / "copy";
    fs::copy(output, copy, fs::copy_options::recursive);
    const std::string newest = CheckpointsIn(output).back().stem().string();
    const std::vector<std::string> arguments = Trainer(Workspace(), output, {"--resume", "1"});
    const Outcome alone = RunSemfoam(arguments);
    EXPECT_EQ(alone.exit_code, 0) << alone.err;
    EXPECT_THAT(alone.err, HasSubstr("Going on from"));
    ExpectWhole(output);
    const Outcome on_three =
        RunProgram(SEMFOAM_MPIRUN, OnRanks(3, Trainer(Workspace(), copy, {"--resume", "1"})));
    EXPECT_EQ(on_three.exit_code, 0) << on_three.err;
    EXPECT_THAT(on_three.err,
                HasSubstr("Going on from " + (copy / "checkpoints" / newest).string()));
    ExpectWhole(copy);
  }
};

TEST_F(MpiTest, EndsWithTheBytesOfOneProcess) {
  const TempFolder folder;
  for (const int num_ranks : {1, 2, 3, 5}) {
    SCOPED_TRACE(num_ranks);
    const fs::path output = folder / std::to_string(num_ranks);
    const Outcome outcome =
        RunProgram(SEMFOAM_MPIRUN, OnRanks(num_ranks, Trainer(Workspace(), output)));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("Each of " + std::to_string(num_ranks) + " rank"));
    ExpectWhole(output);
  }
}

TEST_F(MpiTest, EndsWithTheSameBytesOverANetwork) {
  constexpr int kMissing = 77;
  const TempFolder folder;
  const Outcome outcome =
      RunProgram(SEMFOAM_TEST_SOURCE "/on_two_hosts",
                 Joined({"1000", SEMFOAM_PROGRAM},
                        Joined(Trainer(Workspace(), folder / "out"), {"--mpi", "1"})));
  if (outcome.exit_code == kMissing) GTEST_SKIP() << outcome.err;
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Each of 2 ranks"));
  ExpectWhole(folder / "out");
}

TEST_F(MpiTest, ALostRankLeavesACheckpoint) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  const Outcome lost = TrainAndSignal(output, /*rank=*/1, SIGKILL);
  EXPECT_NE(lost.exit_code, 0);
  EXPECT_THAT(lost.Errors(), ElementsAre(HasSubstr("Rank 1 of 2 was lost; "))) << lost.err;
  const auto checkpoints = CheckpointsIn(output);
  ASSERT_EQ(checkpoints.size(), 2u);
  EXPECT_THAT(lost.err,
              HasSubstr("Stopped after iteration " + checkpoints.back().stem().string() +
                        ". To go on from there: "));
  ExpectGoesOn(output);
}

TEST_F(MpiTest, WithoutRankZeroTheCheckpointsStay) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  const Outcome lost = TrainAndSignal(output, /*rank=*/0, SIGKILL);
  EXPECT_NE(lost.exit_code, 0);
  EXPECT_THAT(lost.err, HasSubstr("rank 0"));  // by mpirun
  ExpectGoesOn(output);
}

TEST_F(MpiTest, ASignalToAnyRankStopsAll) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  const Outcome stopped = TrainAndSignal(output, /*rank=*/1, SIGTERM);
  EXPECT_EQ(stopped.exit_code, 143);
  EXPECT_THAT(stopped.Errors(), IsEmpty());
  EXPECT_THAT(stopped.err, HasSubstr("To go on from there: "));
  ExpectGoesOn(output);
}

// The terminal sends the signal to mpirun, and that ends all ranks.
TEST_F(MpiTest, ControlCStopsAll) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  Running running(OnRanks(2, SavingTrainer(Workspace(), output)), SEMFOAM_MPIRUN);
  ASSERT_TRUE(running.WaitUntil([&] { return CheckpointsIn(output).size() == 2; }));
  const Outcome stopped = running.End(SIGINT);
  EXPECT_NE(stopped.exit_code, 0);
  EXPECT_THAT(stopped.Errors(), IsEmpty());
  EXPECT_THAT(stopped.err, HasSubstr("To go on from there: "));
  ExpectGoesOn(output);
}

// The times of rank 0 choose the schedule of all, which then makes the same bytes alone.
TEST_F(MpiTest, HasTheTimeBudgetOfRankZero) {
  const TempFolder folder;
  const Outcome outcome = RunProgram(
      SEMFOAM_MPIRUN,
      OnRanks(2,
              TrainerOn(Workspace(),
                        folder / "budget",
                        {"--FoamTraining.time_budget", "4", "--FoamTraining.sweep_photos", "0"})));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string before = "The same foam again, without a budget: ";
  const size_t at = outcome.err.find(before);
  ASSERT_NE(at, std::string::npos) << outcome.err;
  std::istringstream schedule(
      outcome.err.substr(at + before.size(), outcome.err.find('\n', at) - at - before.size()));
  std::vector<std::string> arguments = TrainerOn(Workspace(), folder / "alone");
  for (std::string word; schedule >> word;) arguments.push_back(word);
  const Outcome alone = RunSemfoam(arguments);
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  // The model names its schedule, a budget or not.
  EXPECT_TRUE(ReadFile(folder / "budget/scene.foam") == ReadFile(folder / "alone/scene.foam"));
}

TEST_F(MpiTest, SaysWhatIsWrongOnce) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  const Outcome missing =
      RunProgram(SEMFOAM_MPIRUN, OnRanks(3, Trainer(folder / "nothing", output)));
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.Errors(), ElementsAre(HasSubstr((folder / "nothing").string())));
  EXPECT_THAT(FilesBelow(output), IsEmpty());

  for (const std::string wrong : {"--no_such_option", "--FoamTraining.num_rays"}) {
    const Outcome refused =
        RunProgram(SEMFOAM_MPIRUN, OnRanks(3, TrainerOn(Workspace(), output, {wrong, "many"})));
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.Errors(), ElementsAre(HasSubstr(wrong)));
  }

  // Two ranks with different commands.
  std::vector<std::string> arguments = OnRanks(1, Trainer(Workspace(), output));
  arguments.push_back(":");
  arguments = Joined(arguments, {"-n", "1", SEMFOAM_PROGRAM});
  arguments = Joined(
      arguments,
      Joined(Trainer(Workspace(), output, {"--FoamTraining.tv_weight", "1"}), {"--mpi", "1"}));
  const Outcome differ = RunProgram(SEMFOAM_MPIRUN, arguments);
  EXPECT_EQ(differ.exit_code, 1);
  EXPECT_THAT(differ.Errors(),
              ElementsAre(HasSubstr("Rank 1 of 2 has other options or files than rank 0; ")));
  EXPECT_THAT(FilesBelow(output), IsEmpty());

  // The second rank alone does not find its photos.
  arguments = Joined(OnRanks(1, Trainer(Workspace(), output)), {":", "-n", "1", SEMFOAM_PROGRAM});
  arguments = Joined(arguments, Joined(Trainer(folder / "nothing", output), {"--mpi", "1"}));
  const Outcome one_fails = RunProgram(SEMFOAM_MPIRUN, arguments);
  EXPECT_EQ(one_fails.exit_code, 1);
  EXPECT_THAT(
      one_fails.Errors(),
      testing::UnorderedElementsAre(HasSubstr("Rank 1 of 2: " + (folder / "nothing").string()),
                                    HasSubstr("Rank 1 of 2 has ended by an error of its own; ")));
}

}  // namespace
}  // namespace semfoam
