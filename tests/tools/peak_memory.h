// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "tests/tools/program.h"
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace semfoam {

// At least the bytes of address space that a sanitizer reserves before main, which count against
// limits of data.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr int64_t kReservedBySanitizer = int64_t{20} << 40;
#elif defined(__SANITIZE_THREAD__)
inline constexpr int64_t kReservedBySanitizer = int64_t{200} << 40;
#else
inline constexpr int64_t kReservedBySanitizer = 0;
#endif

struct MeasuredRun {
  Outcome outcome;
  int64_t peak_bytes = 0;  // resident, of the program alone
  double cpu_seconds = 0;  // of all its threads
};

// Runs the program without a shell, so that its peak can be told from that of other runs. With
// `memory_limit` > 0, it may have no more data than that.
inline MeasuredRun MeasureSemfoam(const std::vector<std::string>& arguments,
                                  int64_t memory_limit = 0) {
  const TempFolder folder;
  const std::string out = (folder / "out").string(), err = (folder / "err").string();
  std::vector<char*> argv = {const_cast<char*>(SEMFOAM_PROGRAM)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    if (memory_limit > 0) {
      const auto bytes = static_cast<rlim_t>(memory_limit + kReservedBySanitizer);
      const rlimit limit = {bytes, bytes};
      ::setrlimit(RLIMIT_DATA, &limit);
    }
    if (std::freopen(out.c_str(), "w", stdout) != nullptr &&
        std::freopen(err.c_str(), "w", stderr) != nullptr) {
      ::execv(SEMFOAM_PROGRAM, argv.data());
    }
    ::_exit(127);
  }
  int status = 0;
  rusage usage = {};
  EXPECT_EQ(::wait4(child, &status, 0, &usage), child);
  MeasuredRun run;
  run.outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  run.outcome.out = ReadFile(out);
  run.outcome.err = ReadFile(err);
  run.peak_bytes = int64_t{1024} * usage.ru_maxrss;
  for (const timeval& time : {usage.ru_utime, usage.ru_stime}) {
    run.cpu_seconds += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return run;
}

// The bytes that `text` says last before `what`, as in "1.23 GB in all" or "456 MB in all"; -1
// where there are none.
inline double LastBytesBefore(const std::string& text, const std::string& what) {
  const std::regex pattern("([0-9.]+) (GB|MB) " + what);
  double bytes = -1;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    bytes = std::stod((*match)[1]) * ((*match)[2] == "GB" ? 1e9 : 1e6);
  }
  return bytes;
}

}  // namespace semfoam
