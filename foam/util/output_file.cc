// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/output_file.h"

#include "foam/util/error.h"

#include <cerrno>
#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Asks the kernel to put the file or folder on the disk; returns 0 or the errno.
int Sync(int descriptor) {
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  // Some file systems cannot sync a folder; the rename itself is still atomic there.
  return error == EINVAL ? 0 : error;
}

void SyncFolder(const fs::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  Sync(descriptor);
  ::close(descriptor);
}

}  // namespace

OutputFile::OutputFile(fs::path target)
    : target_(std::move(target)),
      folder_(target_.parent_path(), target_),
      temporary_(folder_.path() / target_.filename()),
      descriptor_(::open(temporary_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644)) {
  if (descriptor_ >= 0) return;
  throw UserError(target_.string(),
                  ": cannot be written (",
                  std::generic_category().message(errno),
                  "); choose an output path that you may write to.");
}

OutputFile::~OutputFile() { ::close(descriptor_); }

void OutputFile::Commit() {
  // By the descriptor that was open all along: one that is opened now would not be told of a write
  // that has already failed.
  int error = Sync(descriptor_);
  if (error == 0) error = MoveOutOfScratch(temporary_, target_);
  if (error != 0) {
    throw UserError(target_.string(),
                    ": cannot be written (",
                    std::generic_category().message(error),
                    "); is the disk full, or is a folder of that name in the way?");
  }
  SyncFolder(target_.parent_path());
}

void RequireWritableFolder(const fs::path& folder) { const ScratchFolder probe(folder); }

void WriteTextFile(const fs::path& target, std::string_view text) {
  OutputFile file(target);
  {
    std::ofstream out(file.temporary_path(), std::ios::binary);
    out << text;
    out.flush();
    if (!out) throw UserError(target.string(), ": cannot be written completely; is the disk full?");
  }
  file.Commit();
}

}  // namespace semfoam
