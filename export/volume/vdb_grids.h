// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Makes OpenVDB grids. The only header of export/ that includes OpenVDB: for the .cc files of
// export/.

#include "export/scene/exportable_scene.h"
#include "export/volume/voxelizer.h"
#include "foam/util/ids.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

namespace semfoam {

// Registers OpenVDB's types. Must be called before any other function of OpenVDB.
void InitializeOpenVdb();

// Values of one cell in the grids: in the world (COLMAP) frame, colour in linear light.
struct CellValues {
  // Extinction per world unit.
  float density = 0;
  openvdb::Vec3s color{0.f};
  float confidence = 0;
};

// Labels of the cells in the grids.
struct VoxelLabels {
  // Label of each cell; empty: all cells have the label `of_all`.
  std::span<const LabelId> by_cell;
  LabelId of_all = kNoObject;

  LabelId Of(uint32_t cell) const { return by_cell.empty() ? of_all : by_cell[cell]; }
};

// The types of label grids to make.
struct LabelGrids {
  bool label = true;
  bool label_int32 = false;
};

// Grids with the same active voxels, without names and transforms; null if not requested.
struct VoxelGrids {
  openvdb::FloatGrid::Ptr density, label, confidence;
  openvdb::Vec3SGrid::Ptr color;
  openvdb::Int32Grid::Ptr label_int32;
  int64_t num_voxels = 0;
};

// Makes grids of the voxels of `voxelizer`. Each voxel has the values of its cell (`values`, by
// cell), or the combined values of its samples (VolumeExportOptions::supersample). Calls
// progress(share), unless it is empty, from any thread, one call at a time. Returns the same grids
// on any number of threads.
VoxelGrids MakeVoxelGrids(const CellVoxelizer& voxelizer,
                          const std::vector<CellValues>& values,
                          const VoxelLabels& labels,
                          const LabelGrids& wanted,
                          const std::function<void(double)>& progress);

// Makes the narrow-band level set of the object's surface (ExtractSurface), clipped to `box`
// (normalised frame): class level set, half width 3 voxels, distances in the unit in which a voxel
// is `voxel_size` long, negative inside, without a name and a transform. The distance is that to
// the nearest triangle, in the whole band, or to the clipping plane; the sign of a voxel is that of
// the cell that holds its centre, so that the grid agrees with the others of the object's file in
// every voxel, even in sheets and spikes thinner than a voxel. Returns the same bytes on any number
// of threads.
//
// Does not use openvdb::tools::meshToVolume, which propagates nearest triangles from voxel to
// voxel: its distances beyond the first voxel are up to 0.9 voxels off on surfaces of cells, and
// depend on the threads where two triangles are equally near.
openvdb::FloatGrid::Ptr MakeSurfaceLevelSet(const ExportableScene& scene,
                                            const ObjectInfo& object,
                                            const VoxelLattice& lattice,
                                            const Eigen::AlignedBox3d& box,
                                            double voxel_size);

// Does the same for a closed surface, its vertices in the normalised frame, and the voxels inside
// of it: blocks in ascending order (PackBlock), whose voxels outside have kNoCell. They must be
// known in LevelSetRegion.
openvdb::FloatGrid::Ptr MakeLevelSet(const std::vector<Eigen::Vector3d>& vertices,
                                     const std::vector<std::array<uint32_t, 3>>& triangles,
                                     const std::vector<VoxelBlock>& inside,
                                     const VoxelLattice& lattice,
                                     const Eigen::AlignedBox3d& box,
                                     double voxel_size);
// Returns `box` with all around it that changes its level set; empty if it is.
Eigen::AlignedBox3d LevelSetRegion(const VoxelLattice& lattice, const Eigen::AlignedBox3d& box);

// Makes a grid of points, one at the site of every cell in `cells`, with the float attributes
// "density", "confidence", "radius" (of the cell, in world units), "color" (vec3s), and the int32
// "label" (of the cell's own class) and "object" (id of the object that it is part of, 0 = none).
// `values` is indexed by cell. Positions are stored relative to voxels of `world_from_index`, so
// that an offset of the world does not reduce their precision.
openvdb::points::PointDataGrid::Ptr MakePointGrid(const ExportableScene& scene,
                                                  const std::vector<uint32_t>& cells,
                                                  const std::vector<CellValues>& values,
                                                  const VoxelLattice& lattice,
                                                  const openvdb::math::Transform& world_from_index);

// Write one file by means of OutputFile; the same grids give the same bytes. Throw UserError when
// it cannot be written completely.
void WriteVdb(const std::filesystem::path& path,
              const openvdb::GridPtrVec& grids,
              const openvdb::MetaMap& metadata);
void WriteNanoVdb(const std::filesystem::path& path, const openvdb::GridPtrVec& grids);

}  // namespace semfoam
