// SPDX-License-Identifier: GPL-3.0-or-later
//
// For LD_PRELOAD: makes system calls on the files below one folder fail as a full disk, a damaged
// one or a hostile neighbour makes them fail. Environment:
//   SEMFOAM_FAULT_FOLDER  the folder, absolute; other files are left alone
//   SEMFOAM_FAULT         OPERATION:AT:ERRNO, the operation being
//     bytes   the byte AT of all that is written is the first that no longer fits; the disk stays
//     full write, fsync, rename, mkdir, open   the AT-th call, from 0, fails, and all after it
//     short   every write takes three quarters of what it is given, every other one fails with
//     EINTR unlink, cut   the AT-th time that a file of the folder is opened to be read, it has
//     just been
//             removed, or cut to a third
//   SEMFOAM_FAULT_REPORT  at the end a file of lines "OPERATION COUNT" is written there
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

namespace {

enum Operation { kBytes, kWrite, kFsync, kRename, kMkdir, kOpen, kRead, kNumOperations };
constexpr const char* kNames[kNumOperations] = {
    "bytes", "write", "fsync", "rename", "mkdir", "open", "read"};

struct Plan {
  std::string folder;
  std::string operation;
  int64_t at = 0;
  int error = 0;
  std::atomic<int64_t> counts[kNumOperations] = {};
  std::atomic<bool> interrupt_next = false;

  Plan() {
    if (const char* text = std::getenv("SEMFOAM_FAULT_FOLDER")) folder = text;
    const char* fault = std::getenv("SEMFOAM_FAULT");
    if (fault == nullptr) return;
    const std::string text = fault;
    const size_t first = text.find(':');
    const size_t second = text.find(':', first + 1);
    operation = text.substr(0, first);
    at = std::atoll(text.substr(first + 1, second - first - 1).c_str());
    error = std::atoi(text.substr(second + 1).c_str());
  }

  ~Plan() {
    const char* report = std::getenv("SEMFOAM_FAULT_REPORT");
    if (report == nullptr) return;
    std::string text;
    for (int i = 0; i < kNumOperations; ++i) {
      text += std::string(kNames[i]) + " " + std::to_string(counts[i]) + "\n";
    }
    const int file = ::open(report, O_CREAT | O_TRUNC | O_WRONLY, 0644);
    if (::write(file, text.data(), text.size()) < 0) std::abort();
  }

  bool Concerns(const char* path) const {
    return !folder.empty() && path != nullptr &&
           std::strncmp(path, folder.c_str(), folder.size()) == 0;
  }

  bool Concerns(int file) const {
    char path[4096];
    const ssize_t length =
        ::readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof(path) - 1);
    if (length < 0) return false;
    path[length] = 0;
    return Concerns(path);
  }

  // Counts the call; whether it is to fail, with errno set.
  bool Fails(Operation which) {
    const int64_t count = counts[which]++;
    if (operation != kNames[which] || count < at) return false;
    errno = error;
    return true;
  }
};

Plan& ThePlan() {
  static Plan plan;
  return plan;
}

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

ssize_t NextWrite(int file, const void* bytes, size_t size) {
  static auto* const next = Next<ssize_t(int, const void*, size_t)>("write");
  return next(file, bytes, size);
}

ssize_t Write(int file, const void* bytes, size_t size) {
  Plan& plan = ThePlan();
  if (!plan.Concerns(file)) return NextWrite(file, bytes, size);
  if (plan.Fails(kWrite)) return -1;
  if (plan.operation == "short" && size > 1) {
    // Never twice in a row, or nothing would ever be written.
    const bool interrupt = plan.interrupt_next;
    plan.interrupt_next = !interrupt;
    if (interrupt) {
      errno = EINTR;
      return -1;
    }
    size -= size / 4;
  }
  if (plan.operation == "bytes") {
    const int64_t room = plan.at - plan.counts[kBytes];
    if (room <= 0 && size > 0) {
      errno = plan.error;
      return -1;
    }
    if (static_cast<int64_t>(size) > room) size = static_cast<size_t>(room);
  }
  const ssize_t written = NextWrite(file, bytes, size);
  if (written > 0) plan.counts[kBytes] += written;
  return written;
}

// Before a file is read: what a neighbour does to it.
void Spoil(const char* path) {
  Plan& plan = ThePlan();
  if (!plan.Concerns(path)) return;
  const int64_t count = plan.counts[kRead]++;
  if (count != plan.at) return;
  struct stat status;
  if (plan.operation == "unlink") ::unlink(path);
  if (plan.operation == "cut" && ::stat(path, &status) == 0 &&
      ::truncate(path, status.st_size / 3)) {
    std::abort();
  }
}

bool OpenFails(const char* path, int flags) {
  Plan& plan = ThePlan();
  if ((flags & O_ACCMODE) == O_RDONLY) {
    if ((flags & O_DIRECTORY) == 0) Spoil(path);
    return false;
  }
  return plan.Concerns(path) && plan.Fails(kOpen);
}

ssize_t WriteCookie(void* cookie, const char* bytes, size_t size) {
  const int file = static_cast<int>(reinterpret_cast<intptr_t>(cookie));
  size_t done = 0;
  // As stdio does with a file of its own: a short write goes on, an error of the first ends it.
  while (done < size) {
    const ssize_t written = Write(file, bytes + done, size - done);
    if (written < 0) return done > 0 ? static_cast<ssize_t>(done) : 0;
    done += static_cast<size_t>(written);
  }
  return static_cast<ssize_t>(done);
}

int SeekCookie(void* cookie, off64_t* offset, int whence) {
  const off64_t at =
      ::lseek64(static_cast<int>(reinterpret_cast<intptr_t>(cookie)), *offset, whence);
  if (at < 0) return -1;
  *offset = at;
  return 0;
}

int CloseCookie(void* cookie) {
  return ::close(static_cast<int>(reinterpret_cast<intptr_t>(cookie)));
}

// libc's stdio does not call our write(): files that are written by it become streams that do.
// libstdc++ only takes the descriptor of its FILE, and calls write() itself.
FILE* Open(const char* path, const char* mode, const void* caller, const char* name) {
  auto* const next = Next<FILE*(const char*, const char*)>(name);
  const bool writes = std::strpbrk(mode, "wa+") != nullptr;
  if (OpenFails(path, writes ? O_WRONLY : O_RDONLY)) return nullptr;
  Dl_info info = {};
  const bool is_stream = ::dladdr(caller, &info) != 0 && info.dli_fname != nullptr &&
                         std::strstr(info.dli_fname, "libstdc++") != nullptr;
  FILE* const file = next(path, mode);
  if (file == nullptr || is_stream || mode[0] != 'w' || !ThePlan().Concerns(path)) return file;
  const int descriptor = ::dup(::fileno(file));
  ::fclose(file);
  return ::fopencookie(reinterpret_cast<void*>(static_cast<intptr_t>(descriptor)),
                       "w",
                       {nullptr, WriteCookie, SeekCookie, CloseCookie});
}

}  // namespace

extern "C" {

ssize_t write(int file, const void* bytes, size_t size) { return Write(file, bytes, size); }

ssize_t writev(int file, const struct iovec* pieces, int count) {
  ssize_t total = 0;
  for (int i = 0; i < count; ++i) {
    const ssize_t written = Write(file, pieces[i].iov_base, pieces[i].iov_len);
    if (written < 0) return total > 0 ? total : -1;
    total += written;
    if (static_cast<size_t>(written) < pieces[i].iov_len) break;
  }
  return total;
}

int fsync(int file) {
  static auto* const next = Next<int(int)>("fsync");
  return ThePlan().Concerns(file) && ThePlan().Fails(kFsync) ? -1 : next(file);
}

int rename(const char* from, const char* to) {
  static auto* const next = Next<int(const char*, const char*)>("rename");
  return ThePlan().Concerns(to) && ThePlan().Fails(kRename) ? -1 : next(from, to);
}

int mkdir(const char* path, mode_t mode) {
  static auto* const next = Next<int(const char*, mode_t)>("mkdir");
  return ThePlan().Concerns(path) && ThePlan().Fails(kMkdir) ? -1 : next(path, mode);
}

int open(const char* path, int flags, ...) {
  static auto* const next = Next<int(const char*, int, ...)>("open");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return OpenFails(path, flags) ? -1 : next(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  static auto* const next = Next<int(const char*, int, ...)>("open64");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return OpenFails(path, flags) ? -1 : next(path, flags, mode);
}

FILE* fopen(const char* path, const char* mode) {
  return Open(path, mode, __builtin_return_address(0), "fopen");
}

FILE* fopen64(const char* path, const char* mode) {
  return Open(path, mode, __builtin_return_address(0), "fopen64");
}

}  // extern "C"
