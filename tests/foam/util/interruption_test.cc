// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/interruption.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/util/scratch_folder.h"

#include <csignal>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/temp_folder.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

// Each death test is a process of its own, in which no thread runs before HandleInterruptions.
namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ExitedWithCode;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

[[noreturn]] void WaitForTheEnd() {
  while (true) ::pause();
}

void Send(int signal) { ::kill(::getpid(), signal); }

// Sends the signal and waits until it has been held back.
void SendAndAwait(int signal) {
  Send(signal);
  while (InterruptionRequested() == 0) ::usleep(1000);
}

class InterruptionSignals : public ::testing::TestWithParam<std::pair<int, int>> {};

INSTANTIATE_TEST_SUITE_P(Interruption,
                         InterruptionSignals,
                         ::testing::Values(std::pair(SIGINT, 130),
                                           std::pair(SIGTERM, 143),
                                           std::pair(SIGHUP, 129)));

TEST_P(InterruptionSignals, EndTheProcessWithoutUnfinishedFiles) {
  const TempFolder folder;
  const auto [signal, exit_code] = GetParam();
  EXPECT_EXIT(
      {
        HandleInterruptions();
        WriteTextFile(folder / "finished", "all of it");
        const OutputFile file(folder / "a" / "unfinished.vdb");
        const ScratchFolder scratch(folder / "b");
        WriteTextFile(scratch.path() / "deep" / "finished", "for nobody");
        std::ofstream(file.temporary_path()) << "half of";
        Send(signal);
        WaitForTheEnd();
      },
      ExitedWithCode(exit_code),
      "^$");
  EXPECT_THAT(FilesBelow(folder.path()), UnorderedElementsAre("finished"));
  EXPECT_TRUE(fs::is_empty(folder / "b"));
}

TEST(Interruption, TellsWhatIsLeftToDoBeforeItEnds) {
  const TempFolder folder;
  EXPECT_EXIT(
      {
        HandleInterruptions();
        const OnInterrupt say([] { std::fputs("there is more to do\n", stderr); });
        {
          const OnInterrupt done([] { std::fputs("this is done\n", stderr); });
        }
        const OnInterrupt also([] { std::fputs("and here, too\n", stderr); });
        const OutputFile file(folder / "unfinished.vdb");
        Send(SIGINT);
        WaitForTheEnd();
      },
      ExitedWithCode(130),
      "^there is more to do\nand here, too\n$");
  EXPECT_THAT(FilesBelow(folder.path()), IsEmpty());
  // Who holds signals back says it himself.
  EXPECT_EXIT(
      {
        HandleInterruptions();
        const OnInterrupt say([] { std::fputs("there is more to do\n", stderr); });
        try {
          const DeferInterruption until_safe;
          SendAndAwait(SIGTERM);
          throw Interruption(SIGTERM);
        } catch (const Interruption& interruption) {
          ::_exit(interruption.ExitCode());
        }
      },
      ExitedWithCode(143),
      "^$");
}

TEST(Interruption, LeavesNothingOfThreadsThatWriteManyFiles) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    const TempFolder folder;
    EXPECT_EXIT(
        {
          HandleInterruptions();
          std::vector<std::thread> threads;
          for (int t = 0; t < 4; ++t) {
            threads.emplace_back([&, t] {
              try {
                for (int i = 0;; ++i) {
                  WriteTextFile(folder / (std::to_string(t) + "_" + std::to_string(i % 50)),
                                std::string(100000, 'x'));
                }
              } catch (const UserError&) {
                // As main does: its folder was removed under it, which nobody is to hear of.
                WaitIfExiting();
                ::_exit(1);
              }
            });
          }
          while (!fs::exists(folder / "0_0")) ::usleep(1000);
          ::usleep(1000 * repeat);
          Send(SIGTERM);
          WaitForTheEnd();
        },
        ExitedWithCode(143),
        "");
    const std::vector<std::string> files = FilesBelow(folder.path());
    EXPECT_FALSE(files.empty());
    for (const std::string& file : files) {
      EXPECT_NE(file[0], '.') << file;
      EXPECT_EQ(fs::file_size(folder / file), 100000u);
    }
  }
}

TEST(Interruption, IsHeldBackUntilTheScopeEnds) {
  const TempFolder folder;
  EXPECT_EXIT(
      {
        HandleInterruptions();
        {
          const DeferInterruption outer;
          {
            const DeferInterruption inner;
            if (InterruptionRequested() != 0) ::_exit(1);
            SendAndAwait(SIGTERM);
          }
          if (InterruptionRequested() != SIGTERM) ::_exit(2);
          WriteTextFile(folder / "brought to safety", "");
        }
        ::_exit(3);
      },
      ExitedWithCode(143),
      "");
  EXPECT_THAT(FilesBelow(folder.path()), UnorderedElementsAre("brought to safety"));
}

TEST(Interruption, EndsAtOnceAtTheSecondSignal) {
  const TempFolder folder;
  EXPECT_EXIT(
      {
        HandleInterruptions();
        const DeferInterruption defer;
        const OutputFile file(folder / "unfinished");
        SendAndAwait(SIGTERM);
        Send(SIGINT);
        WaitForTheEnd();
      },
      ExitedWithCode(130),
      "");
  EXPECT_THAT(FilesBelow(folder.path()), IsEmpty());
}

// As timeout(1) sends it, to the process and to its group.
TEST(Interruption, TakesTheSameSignalTwiceInAMomentForOne) {
  EXPECT_EXIT(
      {
        HandleInterruptions();
        try {
          const DeferInterruption defer;
          SendAndAwait(SIGTERM);
          Send(SIGTERM);
          std::this_thread::sleep_for(std::chrono::milliseconds(200));
          throw Interruption(7);  // not reached where the second one has ended the process
        } catch (const Interruption& interruption) {
          ::_exit(interruption.ExitCode());
        }
      },
      ExitedWithCode(135),
      "");
}

TEST(Interruption, IsAnsweredByAnException) {
  EXPECT_EXIT(
      {
        HandleInterruptions();
        try {
          const DeferInterruption defer;
          SendAndAwait(SIGINT);
          throw Interruption(InterruptionRequested());
        } catch (const Interruption& interruption) {
          // One more than the destructor would have left with.
          ::_exit(interruption.ExitCode() + 1);
        }
      },
      ExitedWithCode(131),
      "");
}

TEST(Interruption, LeavesIgnoredSignalsIgnored) {
  EXPECT_EXIT(
      {
        std::signal(SIGHUP, SIG_IGN);
        HandleInterruptions();
        Send(SIGHUP);
        ::usleep(100000);
        Send(SIGINT);
        WaitForTheEnd();
      },
      ExitedWithCode(130),
      "");
}

TEST(Interruption, IsNotCausedByALimitOfTheFileSizeOrAClosedPipe) {
  const TempFolder folder;
  WriteTextFile(folder / "file", "the old one");
  EXPECT_EXIT(
      {
        HandleInterruptions();
        int ends[2];
        if (::pipe(ends) != 0) ::_exit(1);
        ::close(ends[0]);
        if (::write(ends[1], "x", 1) != -1 || errno != EPIPE) ::_exit(2);
        rlimit limit;
        limit.rlim_cur = limit.rlim_max = 1000;
        ::setrlimit(RLIMIT_FSIZE, &limit);
        try {
          WriteTextFile(folder / "file", std::string(1001, 'x'));
          ::_exit(3);
        } catch (const UserError& error) {
          ::_exit(std::string(error.what()).find("file: cannot be written completely") !=
                          std::string::npos
                      ? 0
                      : 4);
        }
      },
      ExitedWithCode(0),
      "");
  EXPECT_THAT(FilesBelow(folder.path()), UnorderedElementsAre("file"));
  EXPECT_EQ(fs::file_size(folder / "file"), 11u);
}

}  // namespace
}  // namespace semfoam
