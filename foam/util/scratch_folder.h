// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace semfoam {

// A hidden temporary folder, `.semfoam-tmp-PID-N`, for unfinished files. Removed with its contents
// by the destructor, when the process is told to end (foam/util/interruption.h), or, after the
// process was killed, when the next one makes a ScratchFolder in the same parent: a lock released
// on process death distinguishes abandoned folders from live ones. A process may hold several, on
// any threads.
class ScratchFolder {
 public:
  // Creates the folder in `parent`, which is created if missing. Throws UserError on failure; the
  // message names `result`, the file to be produced, or `parent` if that is empty.
  explicit ScratchFolder(const std::filesystem::path& parent,
                         const std::filesystem::path& result = {});
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

// Removes folders of killed processes from `parent`; those of live processes hold their lock and
// stay. Does nothing if `parent` cannot be read.
void RemoveAbandonedScratchFolders(const std::filesystem::path& parent);

// Moves a file out of a ScratchFolder with rename(2): atomically with respect to
// RemoveScratchFoldersAndExit. Returns 0 or the errno.
int MoveOutOfScratch(const std::filesystem::path& from, const std::filesystem::path& to);

// Blocks forever if RemoveScratchFoldersAndExit has begun, else returns. Must be called before an
// error is reported that the removal of the folders may have caused.
void WaitIfExiting();

// Removes all ScratchFolders of this process, prevents other threads from creating more or moving
// files out, and ends the process with `exit_code` without running destructors.
[[noreturn]] void RemoveScratchFoldersAndExit(int exit_code);

}  // namespace semfoam
