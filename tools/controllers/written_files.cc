// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/written_files.h"

#include <glog/logging.h>

namespace semfoam {

void LogWritten(const WrittenFile& file) {
  LOG(INFO) << "  " << file.path << ": " << file.summary;
  if (!file.warning.empty()) LOG(WARNING) << file.path << ": " << file.warning;
}

}  // namespace semfoam
