// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"
#include "export/voxelizer.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

struct VolumeExportOptions {
  // Edge of a voxel in world units, for the scene and all objects; 0 = so that the longest edge of
  // the scene's box holds max_resolution voxels, and an object about half as many, by halving
  // that voxel as often as needed.
  double voxel_size = 0;
  int max_resolution = 256;  // 1..65536; only read where voxel_size is 0

  // The scene's volume leaves out air: cells whose density * radius (normalised frame) is below
  // this, 5 % opaque across the cell.
  float min_optical_depth = 0.05f;

  // Save density, color and confidence with 16 bits on disk; labels and int32 stay exact.
  bool half_float = false;
  // Also write scene_labels_int32.vdb. It stands apart because readers that know only float grids
  // (Python's pyopenvdb, Unreal) refuse a whole file for one grid of integers.
  bool int32_labels = false;

  // More voxels than this are refused before any are made: about 24 bytes of memory each.
  int64_t max_voxels = 500'000'000;

  // The "creator" that the grids name: program and version.
  std::string creator = "Semantic Foam";

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// The lattice of the scene's volume, and the box that scene.vdb fills. The box is the
// robust extent of the solid, photographed cells: per axis from the 1 % to the 99 % quantile of
// their sites, 5 % wider on either side but never wider than the sites themselves, so that a few
// far cells do not decide the voxel size.
struct VolumeFrame {
  VoxelLattice lattice;     // normalised frame
  Eigen::AlignedBox3d box;  // normalised frame
};
VolumeFrame MakeVolumeFrame(const ExportableScene& scene, const VolumeExportOptions& options);

// Each of these writes one .vdb and returns its number of active voxels. The grids, all with the
// same active voxels and one transform (uniform voxels and a translation, in the COLMAP frame; the
// numbers stay small, the offset of a georeferenced scene is in the transform, in double):
//   density     float, fog volume   extinction per unit of the COLMAP frame
//   color       vec3s               linear light (not display values), 0..1
//   label       float               id of the cell's label, 0 = none (the object's id in its file)
//   confidence  float               softmax of the cell's own class, 0..1
// A voxel takes the values of the cell that holds its centre. File and grids carry the metadata of
// export/README.md. Throws UserError when the file cannot be written or would be larger than
// options.max_voxels.
//
// The scene: every cell that is no air, within the frame's box.
int64_t WriteSceneVolume(const std::filesystem::path& path,
                         const ExportableScene& scene,
                         const VolumeFrame& frame,
                         const VolumeExportOptions& options);

// One object, with voxels that nest in the scene's (see voxel_size): all of its cells, except far
// ones: beyond the frame's box by more than a tenth of its
// longest edge, or beyond the 5 % to 95 % quantiles of the object's sites by more than that range
// itself, per axis. An object smaller than a voxel may have no voxel; its file is valid all the
// same.
int64_t WriteObjectVolume(const std::filesystem::path& path,
                          const ExportableScene& scene,
                          const ObjectInfo& object,
                          const VolumeFrame& frame,
                          const VolumeExportOptions& options);

// The scene's labels as integers: one int32 grid "label", the voxels of WriteSceneVolume.
int64_t WriteInt32LabelVolume(const std::filesystem::path& path,
                              const ExportableScene& scene,
                              const VolumeFrame& frame,
                              const VolumeExportOptions& options);

// Writes `scene.vdb`, `objects/<file stem>.vdb` for every object and, on request,
// `scene_labels_int32.vdb` into `output_path`. Calls `on_written` (if any) after each.
std::vector<WrittenFile> ExportVolumes(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

}  // namespace semfoam
