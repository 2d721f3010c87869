// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/input_file.h"

#include "foam/error.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <system_error>

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

// Closes at the end of its scope.
struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

}  // namespace

void RequireRegularFile(const fs::path& path, const std::string& what) {
  struct stat status;
  if (::stat(path.c_str(), &status) != 0) FailUnreadable(path, what, errno);
  CheckMode(path, what, status.st_mode);
  if (::faccessat(AT_FDCWD, path.c_str(), R_OK, AT_EACCESS) != 0) FailUnreadable(path, what, errno);
}

std::string ReadFileBytes(const fs::path& path, const std::string& what) {
  // A pipe that nobody writes to would keep open() waiting.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  struct stat status;
  if (file.number < 0 || ::fstat(file.number, &status) != 0) FailUnreadable(path, what, errno);
  CheckMode(path, what, status.st_mode);
  // One byte more, so that the last read sees the end; and files of /proc say that they have none.
  std::string bytes(static_cast<size_t>(status.st_size) + 1, '\0');
  size_t size = 0;
  for (;;) {
    const ssize_t got = ::read(file.number, bytes.data() + size, bytes.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) FailUnreadable(path, what, errno);
    if (got == 0) break;
    size += static_cast<size_t>(got);
    if (size == bytes.size()) bytes.resize(2 * size);
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
