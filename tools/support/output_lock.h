// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

namespace semfoam {

// The right to write into an output folder, which one process has at a time: two that write the
// same files would leave a mixture. Every command that writes into a folder takes it before it
// reads anything. A lock (flock) on the folder itself, so nothing of it is to be seen, it hinders
// nobody from reading, and it dies with its process.
class OutputLock {
 public:
  // Makes the folder if it is missing. Throws UserError, naming it, where nothing can be written
  // there, or another process has the right. Warns where the file system has no locks, and goes on.
  explicit OutputLock(const std::filesystem::path& folder);
  // Removes what it made and nobody wrote into: bad input leaves nothing.
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  std::vector<std::filesystem::path> made_;  // the deepest first
  int folder_ = -1;                          // descriptor
};

}  // namespace semfoam
