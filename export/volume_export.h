// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"
#include "export/voxelizer.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// What the grids are called: letters, digits and '_', each another. Houdini and Maya, say, look for
// colours under "Cd".
struct GridNames {
  std::string density = "density";
  std::string color = "color";
  std::string label = "label";
  std::string confidence = "confidence";
  std::string surface = "surface";
};

struct VolumeExportOptions {
  // Edge of a voxel in world units, for the scene and all objects; 0 = so that the longest edge of
  // the scene's box holds max_resolution voxels, and an object about half as many, by halving
  // that voxel as often as needed.
  double voxel_size = 0;
  int max_resolution = 256;  // 1..65536; only read where voxel_size is 0

  // Only these objects, see SelectObjects: the others get no files, and the files of the scene hold
  // the cells of these alone. Empty = all, and what is no object too.
  std::string labels;
  // "x0,y0,z0,x1,y1,z1" in world units: no voxel and no point has its centre outside of this box.
  // Empty = no cut.
  std::string crop;

  // Samples along each edge of a voxel, 1..8. One is the voxel's centre. With more, a voxel that
  // any sample finds in a cell has the mean density of all samples (0 where a sample is in no cell
  // of the volume: its coverage), the label that most of its samples have (of equals the lowest),
  // and the mean colour and confidence of the samples with that label. Labels never mix.
  int supersample = 1;

  // The scene's volume leaves out air: cells whose density * radius (normalised frame) is below
  // this, 5 % opaque across the cell.
  float min_optical_depth = 0.05f;

  GridNames grid_names;
  // "float": a grid of its own in each file. "int32": in scene_labels_int32.vdb and nowhere else.
  // "both". Integers stand apart because readers that know only float grids (Python's pyopenvdb,
  // Unreal) refuse a whole file for one grid of them.
  std::string label_grid_type = "float";

  // Save density, color and confidence with 16 bits on disk; labels, int32 and distances stay
  // exact.
  bool half_float = false;
  bool nvdb = false;    // also a NanoVDB .nvdb beside each .vdb of voxels
  bool points = false;  // also scene_points.vdb

  // More voxels than this are refused before any are made: about 24 bytes of memory each.
  int64_t max_voxels = 500'000'000;

  // The "creator" that the grids name: program and version.
  std::string creator = "Semantic Foam";
  // Checksum of the model's file (WriteModel), 16 hexadecimal digits; empty = not known, not said.
  std::string source_checksum;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// The lattice of the scene's volume, and the box that scene.vdb fills. The box is the
// robust extent of the solid, photographed cells: per axis from the 1 % to the 99 % quantile of
// their sites, 5 % wider on either side but never wider than the sites themselves, so that a few
// far cells do not decide the voxel size; cut to options.crop, which never moves the lattice: with
// the same voxel_size, neighbouring crops fit together. Empty where the crop holds nothing of it.
struct VolumeFrame {
  VoxelLattice lattice;     // normalised frame
  Eigen::AlignedBox3d box;  // normalised frame
};
VolumeFrame MakeVolumeFrame(const ExportableScene& scene, const VolumeExportOptions& options);

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
// The scene: every cell that is no air (with options.labels: the cells of those objects, labelled
// as theirs), within the frame's box.
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
// before anything is written, for labels that the scene does not have.
std::vector<WrittenFile> ExportVolumes(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written = nullptr,
    const std::function<void(const VolumeProgress&)>& on_progress = nullptr);

}  // namespace semfoam
