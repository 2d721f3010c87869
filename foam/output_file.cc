// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/output_file.h"

#include "foam/error.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Makes an empty file at `path`, which must not exist yet; returns 0 or the errno.
int MakeEmptyFile(const fs::path& path) {
  const int file = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644);
  if (file < 0) return errno;
  ::close(file);
  return 0;
}

void MakeFolders(const fs::path& folder) {
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

// Asks the kernel to put the file or folder on the disk; returns 0 or the errno.
int Sync(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return errno;
  const int result = ::fsync(file) == 0 ? 0 : errno;
  ::close(file);
  // Some file systems cannot sync a folder; the rename itself is still atomic there.
  return result == EINVAL ? 0 : result;
}

}  // namespace

OutputFile::OutputFile(fs::path target) : target_(std::move(target)) {
  MakeFolders(target_.parent_path());
  // The extension stays: the writers of meshes and volumes choose their format by it.
  temporary_ = target_.parent_path() / ("." + target_.stem().string() + ".tmp" +
                                        std::to_string(::getpid()) + target_.extension().string());
  std::error_code ignored;
  fs::remove(temporary_, ignored);
  if (const int error = MakeEmptyFile(temporary_)) {
    throw UserError(target_.string(),
                    ": cannot be written (",
                    std::strerror(error),
                    "); choose an output path that you may write to.");
  }
}

OutputFile::~OutputFile() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void OutputFile::Commit() {
  int error = Sync(temporary_);
  if (error == 0 && ::rename(temporary_.c_str(), target_.c_str()) != 0) error = errno;
  if (error != 0) {
    throw UserError(target_.string(),
                    ": cannot be written (",
                    std::strerror(error),
                    "); is the disk full, or is a folder of that name in the way?");
  }
  committed_ = true;
  const fs::path folder = target_.parent_path();
  Sync(folder.empty() ? fs::path(".") : folder);
}

void RequireWritableFolder(const fs::path& folder) {
  MakeFolders(folder);
  const fs::path probe = folder / (".semfoam-probe" + std::to_string(::getpid()));
  const int error = MakeEmptyFile(probe);
  if (error != 0) {
    throw UserError(folder.string(),
                    ": nothing can be written into this folder (",
                    std::strerror(error),
                    "); choose an output path that you may write to.");
  }
  std::error_code ignored;
  fs::remove(probe, ignored);
}

void WriteTextFile(const fs::path& target, const std::string& text) {
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
