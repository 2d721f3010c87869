// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/output_lock.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <glog/logging.h>
#include <sys/file.h>
#include <unistd.h>

namespace semfoam {

namespace fs = std::filesystem;

OutputLock::OutputLock(const fs::path& folder) {
  std::error_code ignored;
  for (fs::path path = fs::absolute(folder).lexically_normal(); !fs::exists(path, ignored);
       path = path.parent_path()) {
    made_.push_back(path);
  }
  RequireWritableFolder(folder);
  folder_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_ >= 0 && ::flock(folder_, LOCK_EX | LOCK_NB) == 0) return;
  const int error = errno;
  if (folder_ >= 0) ::close(folder_);
  folder_ = -1;
  if (error == EWOULDBLOCK) {
    throw UserError(folder.string(),
                    ": another process is writing into this folder; wait for its end, or choose "
                    "another.");
  }
  LOG(WARNING) << folder.string() << ": cannot be locked ("
               << std::generic_category().message(error)
               << "), so nothing keeps a second process from writing into it.";
}

OutputLock::~OutputLock() {
  std::error_code not_empty;
  for (const fs::path& path : made_) fs::remove(path, not_empty);
  if (folder_ >= 0) ::close(folder_);
}

}  // namespace semfoam
