// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/block_scene.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Writes the volumes of the scene and of its objects (ExportVolumes) into `output_path`, with a
// line of progress on stderr where that is a terminal. Logs each file and returns all of them.
// `volume.creator` is set to this program and version. Throws UserError as ExportVolumes does.
std::vector<WrittenFile> WriteVolumes(const ExportableScene& scene,
                                      const std::filesystem::path& output_path,
                                      VolumeExportOptions volume);

// As WriteVolumes, for a foam in blocks (ExportBlockVolumes), without progress.
std::vector<WrittenFile> WriteBlockVolumes(BlockScenes* scenes,
                                           ExportableScene* objects,
                                           const std::filesystem::path& output_path,
                                           VolumeExportOptions volume);

}  // namespace semfoam
