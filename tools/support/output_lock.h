// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

namespace semfoam {

// Locks an output folder for one process at a time: two that write the same files would leave a
// mixture. Every command that writes into a folder takes the lock before it reads anything. It is a
// lock (flock) on the folder itself, so that it leaves no file, does not prevent reading, and ends
// with its process.
class OutputLock {
 public:
  // Creates the folder if it is missing. Throws UserError, naming it, where it is not writable, or
  // another process has the lock. Only warns where the file system has no locks.
  explicit OutputLock(const std::filesystem::path& folder);
  // Removes the folders that the constructor created, if they are still empty, so that a run with
  // bad input leaves nothing.
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  // Created folders, the deepest first.
  std::vector<std::filesystem::path> made_;
  // Descriptor.
  int folder_ = -1;
};

}  // namespace semfoam
