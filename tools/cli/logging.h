// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// Sends LOG() messages to stderr, one plain line each, with "WARNING: " before warnings, and to no
// file. On a terminal, erases a progress line first.
void InitLogging(const char* program);

// Sets the verbosity: `info` is whether LOG(INFO) is printed, `level` is glog's v.
void SetLogVerbosity(bool info, int level);

// Lets LOG(ERROR) and worse alone be printed from now on.
void LogErrorsOnly();

}  // namespace semfoam
