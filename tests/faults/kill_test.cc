// SPDX-License-Identifier: GPL-3.0-or-later
#include <cerrno>
#include <chrono>
#include <csignal>
#include <random>
#include <sstream>
#include <thread>

#include "tests/faults/faulty_program.h"
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

// Starts the program without a shell between, so that the signal meets it.
pid_t Start(const std::vector<std::string>& arguments) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  std::vector<char*> line = {const_cast<char*>(SEMFOAM_PROGRAM)};
  for (const std::string& argument : arguments) line.push_back(const_cast<char*>(argument.c_str()));
  line.push_back(nullptr);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  ::execv(SEMFOAM_PROGRAM, line.data());
  ::_exit(127);
}

int Wait(pid_t child) {
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// A command that is ended again and again, at times drawn from the length of a whole run, from the
// share `earliest` of it on.
class Kills {
 public:
  Kills(std::vector<std::string> arguments, fs::path output, double earliest)
      : arguments_(std::move(arguments)), output_(std::move(output)), earliest_(earliest) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(Wait(Start(arguments_)), 0);
    length_ = std::chrono::steady_clock::now() - begin;
    good_ = Snapshot(output_);
    EXPECT_FALSE(good_.empty());
  }

  // Replaces all files by older ones, ends a run by `signal`, and expects old or complete files.
  void KillOnce(int signal) {
    for (const auto& [file, bytes] : good_) {
      WriteFile(output_ / file, file.ends_with(".json") ? bytes + " " : "older");
    }
    const double share = std::uniform_real_distribution<double>(earliest_, 1)(random_);
    const pid_t child = Start(arguments_);
    std::this_thread::sleep_for(share * length_);
    ::kill(child, signal);
    const int exit_code = Wait(child);
    // It may have been quicker than before.
    EXPECT_TRUE(exit_code == 128 + signal || exit_code == 0) << exit_code;
    num_ended_ += exit_code != 0;
    for (const auto& [file, bytes] : Results(output_)) {
      if (file.find(".semfoam-tmp-") != std::string::npos) continue;
      ASSERT_TRUE(good_.contains(file)) << file;
      EXPECT_TRUE(IsGood(file, bytes, good_[file]) || bytes == "older" ||
                  bytes == good_[file] + " ")
          << file;
    }
    if (signal != SIGKILL) {
      EXPECT_THAT(HiddenBelow(output_), IsEmpty());
    }
  }

  // The next run does all, and leaves nothing of those before; with `resume`, it goes on where the
  // last one was when it had begun to train.
  void ExpectGoodRun(bool resume) {
    std::vector<std::string> arguments = arguments_;
    if (resume && fs::exists(output_ / "checkpoints")) {
      arguments.insert(arguments.end(), {"--resume", "1"});
      ++num_resumed_;
    }
    EXPECT_EQ(Wait(Start(arguments)), 0);
    EXPECT_TRUE(AreGood(Snapshot(output_), good_));
    EXPECT_THAT(HiddenBelow(output_), IsEmpty());
  }

  int num_ended() const { return num_ended_; }
  int num_resumed() const { return num_resumed_; }

 private:
  std::vector<std::string> arguments_;
  fs::path output_;
  double earliest_;
  std::chrono::duration<double> length_{};
  std::map<std::string, std::string> good_;
  std::mt19937 random_{7};
  int num_ended_ = 0, num_resumed_ = 0;
};

void KillOften(Kills* kills, int often, bool resume) {
  for (int i = 0; i < often; ++i) {
    kills->KillOnce(SIGKILL);
    if (resume || i % 5 == 4) kills->ExpectGoodRun(resume && i % 5 != 4);
  }
  // So that what the kills left is not blamed on the signals.
  kills->ExpectGoodRun(/*resume=*/false);
  for (const int signal : {SIGINT, SIGTERM}) {
    kills->KillOnce(signal);
    kills->ExpectGoodRun(resume);
  }
  EXPECT_GT(kills->num_ended(), often / 2);
  if (resume) {
    EXPECT_GT(kills->num_resumed(), 0);
  }
  std::printf("%d of %d runs ended by signals, %d gone on with\n",
              kills->num_ended(),
              often + 2,
              kills->num_resumed());
}

TEST(Kill, LeavesOldOrCompleteFilesOfATraining) {
  const TempFolder folder;
  // A few kills are to meet the training: it is most of a run that sweeps few photos.
  std::vector<std::string> command = TinyTrainingCommand(FewPhotos(), folder / "out", "400000");
  command.insert(command.end(), {"--checkpoint_every", "0.1", "--FoamTraining.sweep_photos", "8"});
  Kills kills(command, folder / "out", ManyFaults() ? 0.02 : 0.4);
  KillOften(&kills, ManyFaults() ? 25 : 3, /*resume=*/true);
}

// The disk of the checkpoints is full from some byte on: training goes on with those that it has,
// and so does the next run when there is room again.
TEST(KillCheckpoints, ThatCannotBeWrittenLeaveTheOnesBefore) {
  const TempFolder folder;
  const fs::path out = folder / "out";
  std::vector<std::string> command = TinyTrainingCommand(FewPhotos(), out, "400000");
  command.insert(command.end(), {"--checkpoint_every", "0.1"});
  EXPECT_EQ(Wait(Start(command)), 0);
  const std::string good = ReadFile(out / "scene.foam");
  int64_t bytes = 0;
  {
    fs::create_directory(out / "checkpoints");
    RunWithFault(command, out / "checkpoints", "", folder / "report");
    std::istringstream report(ReadFile(folder / "report"));
    for (std::string operation; report >> operation && operation != "bytes";) report >> bytes;
    report >> bytes;
  }
  ASSERT_GT(bytes, 0);
  std::mt19937_64 random(3);
  for (int i = 0; i < (ManyFaults() ? 20 : 2); ++i) {
    // A quicker run writes fewer checkpoints than the one that was measured.
    const int64_t at = static_cast<int64_t>(random() % (bytes / 4));
    SCOPED_TRACE(at);
    fs::remove_all(out);
    fs::create_directories(out / "checkpoints");
    const Outcome outcome = RunWithFault(
        command, out / "checkpoints", "bytes:" + std::to_string(at) + ":" + std::to_string(ENOSPC));
    // A checkpoint on the way is worth a warning; at the end it is said what is amiss.
    EXPECT_THAT(outcome.err, ::testing::HasSubstr("There is no checkpoint of iteration"));
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], ::testing::HasSubstr("checkpoints/trained.ckpt"));
    EXPECT_THAT(HiddenBelow(out), IsEmpty());
    fs::remove(out / "scene.foam");
    std::vector<std::string> again = command;
    again.insert(again.end(), {"--resume", "1"});
    EXPECT_EQ(Wait(Start(again)), 0);
    EXPECT_EQ(ReadFile(out / "scene.foam"), good);
    EXPECT_FALSE(fs::exists(out / "checkpoints"));
  }
}

TEST(Kill, LeavesOldOrCompleteFilesOfAnExport) {
  const TempFolder folder;
  EXPECT_EQ(Wait(Start(TinyTrainingCommand(FewPhotos(), folder / "foam"))), 0);
  Kills kills({"mesh_exporter",
               "--foam_path",
               (folder / "foam" / "scene.foam").string(),
               "--output_path",
               (folder / "out").string()},
              folder / "out",
              0.02);
  KillOften(&kills, ManyFaults() ? 25 : 3, /*resume=*/false);
}

// A photo that goes, or is cut, while the program runs: after the model and the folder were read,
// and again each time it is read.
TEST(KillNeighbour, TakesAPhotoAway) {
  const TempFolder folder;
  fs::copy(FewPhotos(), folder / "scene", fs::copy_options::recursive);
  const fs::path photo = folder / "scene" / "images" / "0004.jpg";
  for (const char* deed : {"unlink", "cut"}) {
    for (int time = 0;; ++time) {
      SCOPED_TRACE(std::string(deed) + " at opening " + std::to_string(time));
      fs::copy_file(
          FewPhotos() / "images" / "0004.jpg", photo, fs::copy_options::overwrite_existing);
      fs::remove_all(folder / "out");
      fs::create_directories(folder / "out");  // stays, as the run has not made it
      const Outcome outcome = RunWithFault(TinyTrainingCommand(folder / "scene", folder / "out"),
                                           photo,
                                           std::string(deed) + ":" + std::to_string(time) + ":0");
      if (outcome.exit_code == 0) {
        // It was not opened that often.
        EXPECT_GT(time, 0);
        break;
      }
      EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
      ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
      EXPECT_THAT(outcome.Errors()[0], ::testing::HasSubstr("ERROR: " + photo.string()));
      EXPECT_THAT(FilesBelow(folder / "out"), ::testing::Not(::testing::Contains("scene.foam")));
      EXPECT_THAT(HiddenBelow(folder / "out"), IsEmpty());
    }
  }
}

// What is printed is a result too; a reader who has had enough of it is no error.
TEST(KillStandardOutput, ThatIsFullIsAnErrorAndThatIsClosedIsNone) {
  const Outcome full =
      RunProgram("/bin/bash", {"-c", "\"$0\" foam_trainer -h >/dev/full", SEMFOAM_PROGRAM});
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_THAT(full.Errors(),
              ::testing::ElementsAre(::testing::HasSubstr("standard output cannot be written")));
  const Outcome closed = RunProgram(
      "/bin/bash", {"-c", "\"$0\" foam_trainer -h | true; exit ${PIPESTATUS[0]}", SEMFOAM_PROGRAM});
  EXPECT_EQ(closed.exit_code, 0) << closed.err;
  EXPECT_THAT(closed.Errors(), IsEmpty());
}

}  // namespace
}  // namespace semfoam
