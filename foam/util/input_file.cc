// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/input_file.h"

#include "foam/util/error.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void FailUnreadable(const fs::path& path, const std::string& what, int error) {
  if (error == ENOENT || error == ENOTDIR) {
    throw UserError(path.string(), ": there is no such file, where ", what, " should be.");
  }
  throw UserError(path.string(),
                  ": cannot be read (",
                  std::generic_category().message(error),
                  "), where ",
                  what,
                  " should be; may you read it?");
}

void CheckMode(const fs::path& path, const std::string& what, mode_t mode) {
  if (S_ISREG(mode)) return;
  const char* kind = S_ISDIR(mode)    ? "a folder"
                     : S_ISFIFO(mode) ? "a pipe"
                     : S_ISSOCK(mode) ? "a socket"
                                      : "a device";
  throw UserError(path.string(), ": is ", kind, ", where ", what, " should be.");
}

}  // namespace

void RequireRegularFile(const fs::path& path, const std::string& what) {
  struct stat status;
  if (::stat(path.c_str(), &status) != 0) FailUnreadable(path, what, errno);
  CheckMode(path, what, status.st_mode);
  if (::faccessat(AT_FDCWD, path.c_str(), R_OK, AT_EACCESS) != 0) FailUnreadable(path, what, errno);
}

InputFile::InputFile(fs::path path, std::string what)
    : path_(std::move(path)),
      what_(std::move(what)),
      // Without O_NONBLOCK, open() would wait for a writer to a pipe.
      descriptor_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  struct stat status;
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    const int error = errno;
    if (descriptor_ >= 0) ::close(descriptor_);
    FailUnreadable(path_, what_, error);
  }
  if (!S_ISREG(status.st_mode)) ::close(descriptor_);
  CheckMode(path_, what_, status.st_mode);
  size_ = static_cast<uint64_t>(status.st_size);
}

InputFile::~InputFile() { ::close(descriptor_); }

size_t InputFile::Read(void* bytes, size_t count) {
  size_t size = 0;
  while (size < count) {
    const ssize_t got = ::read(descriptor_, static_cast<char*>(bytes) + size, count - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) FailUnreadable(path_, what_, errno);
    if (got == 0) break;
    size += static_cast<size_t>(got);
  }
  return size;
}

std::string ReadFileBytes(const fs::path& path, const std::string& what) {
  InputFile file(path, what);
  // One byte more, so that the last read sees the end; and files of /proc say that they have none.
  std::string bytes(file.size() + 1, '\0');
  size_t size = 0;
  for (;;) {
    size += file.Read(bytes.data() + size, bytes.size() - size);
    if (size < bytes.size()) break;
    bytes.resize(2 * size);
  }
  bytes.resize(size);
  return bytes;
}

std::string_view WithoutByteOrderMark(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

std::string Shortened(std::string_view text) {
  constexpr size_t kMaxBytes = 60;
  std::string shown;
  for (const char c : text) {
    if (shown.size() >= kMaxBytes) return shown + "...";
    const auto byte = static_cast<uint8_t>(c);
    if (byte >= 0x20 && byte != 0x7f) {
      shown += c;
      continue;
    }
    char escaped[8];
    std::snprintf(escaped, sizeof(escaped), "\\x%02x", byte);
    shown += escaped;
  }
  return shown;
}

}  // namespace semfoam
