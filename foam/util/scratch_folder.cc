// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/scratch_folder.h"

#include "foam/util/error.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = ".semfoam-tmp-";

// All that threads share. Never destroyed: a signal may come after the end of main.
struct Registry {
  std::mutex mutex;
  std::set<fs::path> folders;
  std::set<fs::path> swept_parents;
  uint64_t num_made = 0;
};

Registry& TheRegistry() {
  static Registry& registry = *new Registry;
  return registry;
}

// Returns whether it is kPrefix, a number, a dash, a number.
bool IsScratchName(std::string_view name) {
  if (!name.starts_with(kPrefix)) return false;
  name.remove_prefix(kPrefix.size());
  const auto is_number = [](std::string_view text) {
    return !text.empty() &&
           std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  const size_t dash = name.find('-');
  return dash != name.npos && is_number(name.substr(0, dash)) && is_number(name.substr(dash + 1));
}

// Opens the folder and tries to lock it; returns the descriptor that holds the lock, or -1 and
// errno.
int OpenAndLock(const fs::path& folder) {
  const int lock = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (lock < 0 || ::flock(lock, LOCK_EX | LOCK_NB) == 0) return lock;
  const int error = errno;
  ::close(lock);
  errno = error;
  return -1;
}

// Locks a folder that has just been created. Returns false where another process has locked or
// removed it. Where the file system has no locks, returns true without a lock: *lock is -1.
bool LockOwn(const fs::path& folder, int* lock) {
  *lock = OpenAndLock(folder);
  if (*lock < 0) return errno != EWOULDBLOCK && errno != ENOENT;
  struct stat locked;
  struct stat there;
  if (::fstat(*lock, &locked) == 0 && ::stat(folder.c_str(), &there) == 0 &&
      locked.st_ino == there.st_ino) {
    return true;
  }
  ::close(*lock);
  return false;
}

void MakeParents(const fs::path& folder) {
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    throw UserError(folder.string(),
                    ": this folder cannot be made (",
                    error ? error.message() : "a file of that name is in the way",
                    "); choose an output path that you may write to.");
  }
}

}  // namespace

void RemoveAbandonedScratchFolders(const fs::path& parent) {
  // The lock decides, not the number in the name, which may be that of a process in another
  // container or on another machine.
  std::error_code error;
  fs::directory_iterator entry(parent.empty() ? fs::path(".") : parent, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (!IsScratchName(entry->path().filename().native())) continue;
    const int lock = OpenAndLock(entry->path());
    if (lock < 0) continue;
    std::error_code ignored;
    fs::remove_all(entry->path(), ignored);
    ::close(lock);
  }
}

ScratchFolder::ScratchFolder(const fs::path& parent, const fs::path& result) {
  MakeParents(parent);
  Registry& registry = TheRegistry();
  const std::lock_guard guard(registry.mutex);
  if (registry.swept_parents.insert(parent).second) RemoveAbandonedScratchFolders(parent);
  int error = EEXIST;
  while (error == EEXIST) {
    path_ = parent / (std::string(kPrefix) + std::to_string(::getpid()) + "-" +
                      std::to_string(registry.num_made++));
    error = ::mkdir(path_.c_str(), 0755) == 0 ? 0 : errno;
    // Another process that swept before our lock has taken it for abandoned.
    if (error == 0 && !LockOwn(path_, &lock_)) error = EEXIST;
  }
  if (error != 0) {
    const bool has_result = !result.empty();
    throw UserError(has_result ? result.string() : parent.string(),
                    has_result ? ": cannot be written (" : ": nothing can be written here (",
                    std::generic_category().message(error),
                    "); choose an output path that you may write to.");
  }
  registry.folders.insert(path_);
}

ScratchFolder::~ScratchFolder() {
  Registry& registry = TheRegistry();
  const std::lock_guard guard(registry.mutex);
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  registry.folders.erase(path_);
  if (lock_ >= 0) ::close(lock_);
}

int MoveOutOfScratch(const fs::path& from, const fs::path& to) {
  const std::lock_guard guard(TheRegistry().mutex);
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

void WaitIfExiting() { const std::lock_guard guard(TheRegistry().mutex); }

void RemoveScratchFoldersAndExit(int exit_code) {
  Registry& registry = TheRegistry();
  // Never given back: the others wait for the end.
  registry.mutex.lock();
  for (const fs::path& path : registry.folders) {
    // A thread may put one more file into a folder that is being emptied.
    std::error_code error;
    for (int attempt = 0; attempt < 100; ++attempt) {
      fs::remove_all(path, error);
      if (error != std::errc::directory_not_empty) break;
    }
  }
  ::_exit(exit_code);
}

}  // namespace semfoam
