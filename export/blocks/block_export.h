// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/block_scene.h"
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"

#include <filesystem>
#include <functional>
#include <vector>

namespace semfoam {

// Writes what ExportSurfaces writes with the method `cells`, for a foam in blocks: makes the scene
// of one block after the other, keeps the faces of its objects in files below a hidden folder in
// `output_path`, and joins those of one object at a time. `objects` are those of FindBlockObjects;
// what their surfaces tell is added to them (DescribeBySurface). Does not write the glTF file of
// the scene (ExportMadeSurfaces). CHECKs that the options ask for `cells`, without a crop and
// textures. Throws UserError where a file cannot be read or written.
std::vector<WrittenFile> ExportBlockSurfaces(
    BlockScenes* scenes,
    ExportableScene* objects,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

// Does the same for what ExportVolumes writes: one volume at a time, of the voxels that the blocks
// have in it. CHECKs that the options have a single sample in a voxel, and no points. Throws
// UserError, before anything is written, for a volume that would be too large.
std::vector<WrittenFile> ExportBlockVolumes(
    BlockScenes* scenes,
    ExportableScene* objects,
    const std::filesystem::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

}  // namespace semfoam
