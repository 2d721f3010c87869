// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/volume/volume_extent.h"
#include "export/volume/volume_options.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace semfoam {

// The grids of one volume in memory.
struct VolumeGrids;
std::shared_ptr<const VolumeGrids> MakeSceneGrids(const ExportableScene& scene,
                                                  const VolumeFrame& frame,
                                                  const VolumeExportOptions& options);
int64_t NumVoxels(const VolumeGrids& grids);

// The progress of an export.
struct VolumeProgress {
  // Path of the current file, relative to the output folder.
  std::string path;
  // Number of the current file, counted from 1, and of all .vdb files of voxels.
  int file = 0;
  int num_files = 0;
  // Share of the current file's blocks that are filled, 0..1.
  double share = 0;
};

// Write one .vdb (and with options.nvdb one .nvdb beside it) and return its number of active
// voxels. All grids have the same transform (uniform voxels and a translation, in the COLMAP frame;
// the offset of a georeferenced scene is in the transform, in double), and the first four have the
// same active voxels:
//   density     float, fog volume   extinction per unit of the COLMAP frame
//   color       vec3s               linear light (not display values), 0..1
//   label       float               id of the cell's label, 0 = none (the object's id in its file)
//   confidence  float               softmax of the cell's own class, 0..1
//   surface     float, level set    objects only, see MakeSurfaceLevelSet
// A voxel takes the values of the cell that holds its centre (see supersample for more). File and
// grids have the metadata of export/README.md. Throws UserError when the file cannot be written or
// would be larger than options.max_voxels.
//
// Writes the volume of the scene: the cells within the frame's box that are not air and that
// options.objects selects (if it names objects, all of their cells, with their labels).
int64_t WriteSceneVolume(const std::filesystem::path& path,
                         const ExportableScene& scene,
                         const VolumeFrame& frame,
                         const VolumeExportOptions& options);

// Writes the volume of one object, with voxels that nest in the scene's (see voxel_size): all of
// its cells within options.crop, except far ones: beyond the frame's box by more than a tenth of
// its longest edge, or beyond the 5 % to 95 % quantiles of the object's sites by more than that
// range itself, per axis. An object smaller than a voxel may have no voxel; its file is valid even
// then.
int64_t WriteObjectVolume(const std::filesystem::path& path,
                          const ExportableScene& scene,
                          const ObjectInfo& object,
                          const VolumeFrame& frame,
                          const VolumeExportOptions& options);

// Writes into `output_path`, depending on the options: `scene.vdb`, `scene_labels_int32.vdb` (one
// int32 grid, the voxels of scene.vdb), `scene_points.vdb` (a point for each solid cell: see
// MakePointGrid) and `objects/<file stem>.vdb` for every object. Calls `on_written` (if any) after
// each, with a warning where a volume has no voxel, or one, or voxels larger than the object; and
// `on_progress` (if any) from time to time, from any thread, one call at a time. Throws UserError,
// before anything is written, for a volume that would be too large.
std::vector<WrittenFile> ExportVolumes(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written = nullptr,
    const std::function<void(const VolumeProgress&)>& on_progress = nullptr);

}  // namespace semfoam
