// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "export/scene/label_choice.h"

#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Geometry>

namespace semfoam {

// Names of the grids: letters, digits and '_', all different. Houdini and Maya, for example, read
// colours from "Cd".
struct GridNames {
  std::string density = "density";
  std::string color = "color";
  std::string label = "label";
  std::string confidence = "confidence";
  std::string surface = "surface";
};

// The type of the label grids. Integer grids are in a separate file because readers that support
// only float grids (Python's pyopenvdb, Unreal) refuse a whole file with one integer grid.
enum class LabelGridType {
  // A float grid in each file.
  kFloat,
  // An integer grid, in scene_labels_int32.vdb only.
  kInt32,
  kBoth,
};
inline constexpr EnumName<LabelGridType> kLabelGridTypeNames[] = {{LabelGridType::kFloat, "float"},
                                                                  {LabelGridType::kInt32, "int32"},
                                                                  {LabelGridType::kBoth, "both"}};

struct VolumeExportOptions {
  // Edge of a voxel in world units, for the scene and all objects; 0: choose it so that the longest
  // edge of the scene's box has max_resolution voxels, and halve it for each object until that has
  // about half as many.
  double voxel_size = 0;
  // Number of voxels along the longest edge of the scene's box, 1..65536; used if voxel_size is 0.
  int max_resolution = 256;

  // The objects to write files for. The files of the scene hold the cells that it selects
  // (HasCell): all of them if it is empty; only those of the objects that it names; or all but
  // those of the objects that it excludes.
  LabelFilter objects;
  // Box "x0,y0,z0,x1,y1,z1" in world units that contains the centres of all voxels and points;
  // empty: no restriction.
  std::string crop;

  // Number of samples along each edge of a voxel, 1..8. A single sample is the voxel's centre. With
  // more, a voxel with any sample in a cell has the mean density of all samples (0 for samples in
  // no cell of the volume), the label of most of its samples (ties: the lowest), and the mean
  // colour and confidence of the samples with that label. Labels are never mixed.
  int supersample = 1;

  // Minimum density * radius (normalised frame) of a cell in the scene's volume; below it a cell is
  // air. The default is 5 % opacity across the cell.
  float min_optical_depth = 0.05f;

  GridNames grid_names;
  LabelGridType label_grid_type = LabelGridType::kFloat;

  // Whether to store density, color and confidence with 16 bits on disk; labels, int32 and
  // distances stay exact.
  bool half_float = false;
  // Whether to write a NanoVDB .nvdb beside each .vdb of voxels.
  bool nvdb = false;
  // Whether to write scene_points.vdb.
  bool points = false;

  // Maximum number of voxels of a file, checked before any are made. A voxel takes about 24 bytes
  // of memory.
  int64_t max_voxels = 500'000'000;

  // "creator" in the grids' metadata: program and version.
  std::string creator = "Semantic Foam";
  // Checksum of the model's file (WriteModel), 16 hexadecimal digits; empty: not known, and not
  // written.
  std::string source_checksum;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// Parses the box of VolumeExportOptions::crop, world units; returns nothing if the text is empty or
// no box.
std::optional<Eigen::AlignedBox3d> ParseCrop(const std::string& text);

}  // namespace semfoam
