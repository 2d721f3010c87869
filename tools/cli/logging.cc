// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/logging.h"

#include "export/scene/names.h"
#include "tools/support/progress.h"

#include <cstdio>
#include <string>

#include <glog/logging.h>
#include <unistd.h>

namespace semfoam {
namespace {

class PlainLines : public google::LogSink {
 public:
  void send(google::LogSeverity severity,
            const char* /*full_filename*/,
            const char* /*base_filename*/,
            int /*line*/,
            const google::LogMessageTime& /*time*/,
            const char* message,
            size_t length) override {
    // glog itself reports the fatal ones, with a stack trace.
    if (severity >= google::GLOG_FATAL) return;
    const bool erases_line = is_terminal_ || CurrentProgressStyle() == ProgressStyle::kBar;
    std::fprintf(stderr,
                 "%s%s%s\n",
                 erases_line ? "\r\x1b[K" : "",
                 severity >= google::GLOG_WARNING ? "WARNING: " : "",
                 OneLine(std::string(message, length)).c_str());
  }

 private:
  const bool is_terminal_ = ::isatty(STDERR_FILENO) != 0;
};

}  // namespace

void InitLogging(const char* program) {
  // Another library of the process, where this is none of ours, may have done it.
  if (google::IsGoogleLoggingInitialized()) return;
  static PlainLines plain_lines;
  for (const int severity : {google::GLOG_INFO, google::GLOG_WARNING, google::GLOG_ERROR}) {
    google::SetLogDestination(severity, "");
  }
  google::SetLogDestination(google::GLOG_FATAL, "");
  FLAGS_stderrthreshold = google::GLOG_FATAL;
  google::InitGoogleLogging(program);
  google::AddLogSink(&plain_lines);
}

void SetLogVerbosity(bool info, int level) {
  FLAGS_minloglevel = info ? google::GLOG_INFO : google::GLOG_WARNING;
  FLAGS_v = level;
}

void LogErrorsOnly() {
  FLAGS_minloglevel = google::GLOG_ERROR;
  FLAGS_v = 0;
}

}  // namespace semfoam
