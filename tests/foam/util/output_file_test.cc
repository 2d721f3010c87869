// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/output_file.h"

#include "foam/util/error.h"
#include "foam/util/scratch_folder.h"

#include <csignal>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "tests/temp_folder.h"
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAreArray;

// Runs it in a process of its own, which then dies as by kill -9.
void RunAndKill(const std::function<void()>& run) {
  const pid_t child = ::fork();
  if (child == 0) {
    run();
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
}

// What stands in the folder, of whatever kind.
std::vector<std::string> Names(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

void Touch(const fs::path& path) { std::ofstream(path) << "x"; }

TEST(OutputFileScratchFolder, GoesWithItsObject) {
  const TempFolder folder;
  {
    const ScratchFolder one(folder.path());
    const ScratchFolder other(folder.path());
    EXPECT_NE(one.path(), other.path());
    fs::create_directory(one.path() / "deep");
    Touch(one.path() / "deep" / "file");
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(OutputFileScratchFolder, OfAKilledProcessIsRemovedByTheNext) {
  const TempFolder folder;
  RunAndKill([&] {
    const OutputFile file(folder / "scene.foam");
    const ScratchFolder scratch(folder.path());
    Touch(scratch.path() / "file");
    ::kill(::getpid(), SIGKILL);
  });
  EXPECT_EQ(FilesBelow(folder.path()).size(), 2u);
  WriteTextFile(folder / "other", "");
  EXPECT_THAT(Names(folder.path()), ElementsAre("other"));
}

TEST(OutputFileScratchFolder, OfALivingProcessStays) {
  const TempFolder folder;
  const OutputFile file(folder / "scene.foam");
  // The child has inherited that the folder has been swept; by another name it has not.
  RunAndKill([&] { WriteTextFile(folder.path() / "." / "other", ""); });
  EXPECT_TRUE(fs::exists(file.temporary_path()));
  WriteTextFile(folder.path() / "." / "." / "other", "");
  EXPECT_TRUE(fs::exists(file.temporary_path()));
}

// As if it were a process in another container, which may have the number that ours has.
TEST(OutputFileScratchFolder, IsToldByItsLockAlone) {
  const TempFolder folder;
  const fs::path path = folder / (".semfoam-tmp-" + std::to_string(::getpid()) + "-1000000");
  fs::create_directory(path);
  const int lock = ::open(path.c_str(), O_RDONLY);
  ASSERT_EQ(::flock(lock, LOCK_EX), 0);
  WriteTextFile(folder / "other", "");
  EXPECT_TRUE(fs::exists(path));
  ::close(lock);
  WriteTextFile(folder.path() / "." / "other", "");
  EXPECT_FALSE(fs::exists(path));
}

TEST(OutputFileScratchFolder, OnlyWhatCarriesItsNameIsSwept) {
  const TempFolder folder;
  const std::vector<std::string> others = {".semfoam-tmp-",
                                           ".semfoam-tmp-1",
                                           ".semfoam-tmp-1-",
                                           ".semfoam-tmp-1-x",
                                           ".semfoam-tmp-1-1x",
                                           ".semfoam-tmp--1-1",
                                           ".semfoam-tmp-1-1-1",
                                           ".semfoam-tmp-1-1 ",
                                           "semfoam-tmp-1-1"};
  for (const std::string& name : others) fs::create_directory(folder / name);
  Touch(folder / ".semfoam-tmp-1-1");  // a file, which none of ours is
  fs::create_directory_symlink(folder / "semfoam-tmp-1-1", folder / ".semfoam-tmp-1-2");
  fs::create_directory(folder / ".semfoam-tmp-1-3");
  fs::create_directory_symlink(folder / "semfoam-tmp-1-1", folder / ".semfoam-tmp-1-3" / "link");
  Touch(folder / "semfoam-tmp-1-1" / "linked");
  WriteTextFile(folder / "new", "");
  std::vector<std::string> expected = others;
  expected.insert(expected.end(), {"new", ".semfoam-tmp-1-1", ".semfoam-tmp-1-2"});
  EXPECT_THAT(Names(folder.path()), UnorderedElementsAreArray(expected));
  EXPECT_TRUE(fs::exists(folder / "semfoam-tmp-1-1" / "linked"));
}

TEST(OutputFile, ReplacesItsTargetOnlyWhenCommitted) {
  const TempFolder folder;
  WriteTextFile(folder / "file", "old");
  {
    const OutputFile file(folder / "file");
    std::ofstream(file.temporary_path()) << "new";
  }
  EXPECT_EQ(fs::file_size(folder / "file"), 3u);
  WriteTextFile(folder / "file", "newer");
  EXPECT_EQ(fs::file_size(folder / "file"), 5u);
  EXPECT_THAT(FilesBelow(folder.path()), ElementsAre("file"));
}

TEST(OutputFile, TakesAnyNameThatTheFileSystemTakes) {
  const TempFolder folder;
  std::string name(250, 'n');
  name += ".json";
  WriteTextFile(folder / name, "");
  EXPECT_THAT(FilesBelow(folder.path()), ElementsAre(name));
}

TEST(OutputFile, NamesWhatIsInTheWay) {
  const TempFolder folder;
  fs::create_directories(folder / "taken" / "inner");
  Touch(folder / "file");
  const auto error_of = [](const std::function<void()>& call) -> std::string {
    try {
      call();
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(error_of([&] { WriteTextFile(folder / "taken", ""); }),
              ::testing::AllOf(::testing::HasSubstr("taken: cannot be written (Is a directory)"),
                               ::testing::HasSubstr("is a folder of that name in the way?")));
  EXPECT_THAT(error_of([&] { WriteTextFile(folder / "file" / "x", ""); }),
              ::testing::HasSubstr("file: this folder cannot be made"));
  EXPECT_THAT(error_of([&] { RequireWritableFolder(folder / "file"); }),
              ::testing::HasSubstr("file: this folder cannot be made"));
  EXPECT_THAT(error_of([&] { RequireWritableFolder("/proc"); }),
              ::testing::HasSubstr("/proc: nothing can be written here ("));
  EXPECT_THAT(error_of([&] { ScratchFolder("/proc"); }),
              ::testing::HasSubstr("/proc: nothing can be written here ("));
  EXPECT_THAT(error_of([&] { WriteTextFile("/proc/x", ""); }),
              ::testing::HasSubstr("/proc/x: cannot be written ("));
  EXPECT_THAT(FilesBelow(folder.path()), ElementsAre("file"));
}

}  // namespace
}  // namespace semfoam
