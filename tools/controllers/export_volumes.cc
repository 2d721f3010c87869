// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_volumes.h"

#include "tools/controllers/written_files.h"
#include "tools/support/memory_task.h"
#include "tools/support/progress.h"

#include <chrono>
#include <cmath>
#include <iostream>
#include <string>

#include <glog/logging.h>
#include <unistd.h>

namespace semfoam {

std::vector<WrittenFile> WriteVolumes(const ExportableScene& scene,
                                      const std::filesystem::path& output_path,
                                      VolumeExportOptions volume) {
  const MemoryTask task("volumes are made", "a larger voxel_size or a smaller max_resolution");
  LOG(INFO) << "Writing volumes";
  ProgressLine line(std::cerr, ::isatty(STDERR_FILENO) != 0);
  const auto begin = std::chrono::steady_clock::now();
  volume.creator = "semfoam " SEMFOAM_VERSION;
  return ExportVolumes(
      scene,
      output_path,
      volume,
      [&](const WrittenFile& file) {
        line.Clear();
        LogWritten(file);
      },
      [&](const VolumeProgress& progress) {
        const std::chrono::duration<double> since = std::chrono::steady_clock::now() - begin;
        line.Show("  volume " + std::to_string(progress.file) + " of " +
                      std::to_string(progress.num_files) + ", " + progress.path + ": " +
                      std::to_string(std::lround(100 * progress.share)) + " %",
                  since.count());
      });
}

}  // namespace semfoam
