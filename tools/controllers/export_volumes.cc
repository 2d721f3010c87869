// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_volumes.h"

#include "export/blocks/block_export.h"
#include "tools/controllers/written_files.h"
#include "tools/support/memory_task.h"
#include "tools/support/progress.h"

#include <chrono>
#include <cmath>
#include <string>

#include <glog/logging.h>

namespace semfoam {

std::vector<WrittenFile> WriteVolumes(const ExportableScene& scene,
                                      const std::filesystem::path& output_path,
                                      VolumeExportOptions volume) {
  const MemoryTask task("volumes are made", "a larger voxel_size or a smaller max_resolution");
  LOG(INFO) << "Writing volumes";
  ProgressLine line;
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
        const std::string what = "volume " + std::to_string(progress.file) + " of " +
                                 std::to_string(progress.num_files) + ", " + progress.path;
        line.Show({what,
                   (progress.file - 1 + progress.share) / progress.num_files,
                   since.count(),
                   "  " + what + ": " + std::to_string(std::lround(100 * progress.share)) + " %"});
      });
}

std::vector<WrittenFile> WriteBlockVolumes(BlockScenes* scenes,
                                           ExportableScene* objects,
                                           const std::filesystem::path& output_path,
                                           VolumeExportOptions volume) {
  const MemoryTask task("volumes are made", "a larger voxel_size or a smaller max_resolution");
  LOG(INFO) << "Writing volumes, block by block";
  volume.creator = "semfoam " SEMFOAM_VERSION;
  return ExportBlockVolumes(scenes, objects, output_path, volume, LogWritten);
}

}  // namespace semfoam
