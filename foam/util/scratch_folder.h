// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace semfoam {

// A hidden folder, `.semfoam-tmp-PID-N`, for what is no result yet. It goes, with all that is in
// it, with its object; when the process is told to end (foam/util/interruption.h); and, where the
// process was killed, when the next one makes a ScratchFolder beside it. A lock that dies with the
// process tells the ones from each other. Several threads may have some at once.
class ScratchFolder {
 public:
  // Makes it in `parent`, and that if it is missing. Throws UserError where that is not possible,
  // which names `result`, the file that was to come of it, or, where that is empty, `parent`.
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

// Removes the ScratchFolders in `parent` whose processes were killed; those of live processes,
// which hold a lock on theirs, stay. Does nothing where `parent` cannot be read.
void RemoveAbandonedScratchFolders(const std::filesystem::path& parent);

// rename(2) out of a ScratchFolder, which a process that is told to end has done or has not.
// Returns 0 or the errno.
int MoveOutOfScratch(const std::filesystem::path& from, const std::filesystem::path& to);

// Returns, unless RemoveScratchFoldersAndExit has begun. An error that is met from then on may come
// of the folders' removal and is nothing to report.
void WaitIfExiting();

// Removes every ScratchFolder of this process, lets no thread make another or move a file out, and
// ends the process with `exit_code`, without running destructors.
[[noreturn]] void RemoveScratchFoldersAndExit(int exit_code);

}  // namespace semfoam
