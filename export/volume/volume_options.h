// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "export/scene/label_choice.h"

#include <cstdint>
#include <optional>
#include <string>

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

// In which grids the files hold labels. Integers stand apart because readers that know only float
// grids (Python's pyopenvdb, Unreal) refuse a whole file for one grid of them.
enum class LabelGridType {
  kFloat,  // a grid of its own in each file
  kInt32,  // in scene_labels_int32.vdb and nowhere else
  kBoth,
};
inline constexpr EnumName<LabelGridType> kLabelGridTypeNames[] = {{LabelGridType::kFloat, "float"},
                                                                  {LabelGridType::kInt32, "int32"},
                                                                  {LabelGridType::kBoth, "both"}};

struct VolumeExportOptions {
  // Edge of a voxel in world units, for the scene and all objects; 0 = so that the longest edge of
  // the scene's box holds max_resolution voxels, and an object about half as many, by halving
  // that voxel as often as needed.
  double voxel_size = 0;
  int max_resolution = 256;  // 1..65536; only read where voxel_size is 0

  // Objects that this does not have get no files. The files of the scene hold the cells that it
  // has (HasCell): all of them, where it is empty; of some objects alone, where it names these;
  // everything but some objects, where it excludes these.
  LabelFilter objects;
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
  LabelGridType label_grid_type = LabelGridType::kFloat;

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

// The box of VolumeExportOptions::crop, world units; nothing where the text is empty or no box.
std::optional<Eigen::AlignedBox3d> ParseCrop(const std::string& text);

}  // namespace semfoam
