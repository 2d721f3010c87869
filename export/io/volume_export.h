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

// The grids of one volume, made but not written.
struct VolumeGrids;
std::shared_ptr<const VolumeGrids> MakeSceneGrids(const ExportableScene& scene,
                                                  const VolumeFrame& frame,
                                                  const VolumeExportOptions& options);
int64_t NumVoxels(const VolumeGrids& grids);

// How far an export has come.
struct VolumeProgress {
  std::string path;   // of the file being made, relative to the output folder
  int file = 0;       // its number, from 1
  int num_files = 0;  // .vdb files of voxels
  double share = 0;   // of the file's blocks that are filled, 0..1
};

// Each of these writes one .vdb (and with options.nvdb one .nvdb beside it) and returns its number
// of active voxels. The grids, with one transform (uniform voxels and a translation, in the COLMAP
// frame; the numbers stay small, the offset of a georeferenced scene is in the transform, in
// double), the first four with the same active voxels:
//   density     float, fog volume   extinction per unit of the COLMAP frame
//   color       vec3s               linear light (not display values), 0..1
//   label       float               id of the cell's label, 0 = none (the object's id in its file)
//   confidence  float               softmax of the cell's own class, 0..1
//   surface     float, level set    objects only, see MakeSurfaceLevelSet
// A voxel takes the values of the cell that holds its centre (see supersample for more). File and
// grids carry the metadata of export/README.md. Throws UserError when the file cannot be written or
// would be larger than options.max_voxels.
//
// The scene: every cell that is no air and that options.objects has (where it names objects: all of
// their cells, labelled as theirs), within the frame's box.
int64_t WriteSceneVolume(const std::filesystem::path& path,
                         const ExportableScene& scene,
                         const VolumeFrame& frame,
                         const VolumeExportOptions& options);

// One object, with voxels that nest in the scene's (see voxel_size): all of its cells, except far
// ones: beyond the frame's box by more than a tenth of its
// longest edge, or beyond the 5 % to 95 % quantiles of the object's sites by more than that range
// itself, per axis; and what options.crop cuts off. An object smaller than a voxel may have no
// voxel; its file is valid all the same.
int64_t WriteObjectVolume(const std::filesystem::path& path,
                          const ExportableScene& scene,
                          const ObjectInfo& object,
                          const VolumeFrame& frame,
                          const VolumeExportOptions& options);

// Writes into `output_path`, as the options ask for it: `scene.vdb`, `scene_labels_int32.vdb` (one
// int32 grid, the voxels of scene.vdb), `scene_points.vdb` (a point for each solid cell: see
// MakePointGrid) and `objects/<file stem>.vdb` for every object. Calls `on_written` (if any) after
// each, with a warning where a volume has no voxel, or one, or voxels larger than the object; and
// `on_progress` (if any) now and then, from any thread, one call at a time. Throws UserError,
// before anything is written, for a volume that would be too large.
std::vector<WrittenFile> ExportVolumes(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written = nullptr,
    const std::function<void(const VolumeProgress&)>& on_progress = nullptr);

}  // namespace semfoam
