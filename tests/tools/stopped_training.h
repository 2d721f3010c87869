// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/tools/program.h"
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// Trainings by the program itself that are stopped in their midst.
namespace semfoam {

namespace fs = std::filesystem;

// The program, or another, at work, until it ends or is ended.
class Running {
 public:
  explicit Running(const std::vector<std::string>& arguments,
                   const std::string& program = SEMFOAM_PROGRAM) {
    std::vector<std::string> words = {program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string log = (folder_ / "err").string();
    process_ = ::fork();
    if (process_ != 0) return;
    ::dup2(::open(log.c_str(), O_CREAT | O_WRONLY, 0644), STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ~Running() {
    if (process_ > 0) End(SIGKILL);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  pid_t process() const { return process_; }

  // What it has written to stderr so far.
  std::string Log() const { return ReadFile(folder_ / "err"); }

  // From now on no file that it writes can be larger, as on a full disk.
  void LimitFileSize(rlim_t bytes) const {
    const rlimit limit{bytes, bytes};
    EXPECT_EQ(::prlimit(process_, RLIMIT_FSIZE, &limit, nullptr), 0);
  }

  // False where it ended before that was so. However long it takes: how slow a machine is, and what
  // a sanitizer adds, is no test's business, and ctest ends what hangs.
  bool WaitUntil(const std::function<bool()>& is_so) {
    while (!is_so()) {
      if (::waitpid(process_, &status_, WNOHANG) == process_) {
        process_ = 0;
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }

  // Halts it where it is, with the files that it has open and locked; End works from there too.
  void Pause() const { EXPECT_EQ(::kill(process_, SIGSTOP), 0); }

  // Sends the signal and waits; the exit code as shells have it, and what it wrote to stderr.
  Outcome End(int signal) {
    if (process_ > 0) ::kill(process_, signal);
    return Wait();
  }

  // Waits for its end; the same.
  Outcome Wait() {
    if (process_ > 0) ::waitpid(process_, &status_, 0);
    process_ = 0;
    return {WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_),
            "",
            ReadFile(folder_ / "err")};
  }

 private:
  const TempFolder folder_;
  pid_t process_ = 0;
  int status_ = 0;
};

// foam_trainer on `workspace`: short, but with all that training does.
inline std::vector<std::string> Trainer(const fs::path& workspace,
                                        const fs::path& output,
                                        const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = TrainerOn(workspace, output, {"--test_every", "8"});
  const std::pair<std::string, std::string> tiny[] = {{"--FoamTraining.num_rays", "50000"},
                                                      {"--FoamTraining.final_sites", "1500"},
                                                      {"--FoamTraining.initial_sites", "800"}};
  arguments.insert(arguments.end(), more.begin(), more.end());
  for (const auto& [name, value] : tiny) {
    if (std::count(more.begin(), more.end(), name) != 0) continue;
    arguments.insert(arguments.end(), {name, value});
  }
  return TinyTraining(arguments);
}

// By name, the newest last.
inline std::vector<fs::path> CheckpointsIn(const fs::path& output) {
  std::vector<std::pair<int, fs::path>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(output / "checkpoints", error)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() != ".ckpt" || stem == "trained") continue;
    found.emplace_back(std::stoi(stem), entry.path());
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> paths;
  for (const auto& [iteration, path] : found) paths.push_back(path);
  return paths;
}

// The same with a checkpoint after every iteration.
inline std::vector<std::string> SavingTrainer(const fs::path& workspace, const fs::path& output) {
  return Trainer(workspace, output, {"--checkpoint_every", "0.001"});
}

// Trains until the run has come so far, and ends it by a signal. Checkpoints that lie there already
// are none of the run's.
inline Outcome TrainAndStop(const fs::path& workspace, const fs::path& output, int signal) {
  const bool replaces = !CheckpointsIn(output).empty();
  Running running(SavingTrainer(workspace, output));
  EXPECT_TRUE(running.WaitUntil([&] {
    if (replaces && !fs::exists(output / "checkpoints" / "replaced")) return false;
    const auto checkpoints = CheckpointsIn(output);
    return checkpoints.size() == 2 && std::stoi(checkpoints.back().stem().string()) >= 20;
  })) << "it ended before it could be stopped";
  return running.End(signal);
}

// A run that nothing stopped, and one that was stopped; read only.
class StoppedTraining : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    CopyTabletop(Workspace());
    const Outcome outcome = RunSemfoam(Trainer(Workspace(), Whole()));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    foam_ = ReadFile(Whole() / "scene.foam");
    ASSERT_EQ(TrainAndStop(Workspace(), *folder_ / "stopped", SIGKILL).exit_code, 128 + SIGKILL);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static fs::path Workspace() { return *folder_ / "it's a workspace"; }
  static fs::path Whole() { return *folder_ / "whole"; }
  // What the stopped run left, for a test of its own.
  static void CopyStopped(const fs::path& output) {
    fs::copy(*folder_ / "stopped", output, fs::copy_options::recursive);
  }
  static void ExpectWhole(const fs::path& output) {
    EXPECT_TRUE(ReadFile(output / "scene.foam") == foam_) << "other bytes";
    EXPECT_EQ(ReadFile(output / "labels.json"), ReadFile(Whole() / "labels.json"));
    EXPECT_EQ(ReadFile(output / "effects.json"), ReadFile(Whole() / "effects.json"));
    // And nothing else: no checkpoint, no unfinished or hidden file.
    auto files = FilesBelow(output), expected = FilesBelow(Whole());
    EXPECT_THAT(files, ::testing::UnorderedElementsAreArray(expected));
    EXPECT_FALSE(fs::exists(output / "checkpoints"));
  }

  static inline TempFolder* folder_ = nullptr;
  static inline std::string foam_;
};

}  // namespace semfoam
