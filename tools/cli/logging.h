// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// Sends what LOG() says to stderr, one plain line each, "WARNING: " before warnings, and to no
// file. On a terminal a progress line in place is wiped first.
void InitLogging(const char* program);

// `info`: whether LOG(INFO) is heard at all. `level`: glog's v.
void SetLogVerbosity(bool info, int level);

}  // namespace semfoam
