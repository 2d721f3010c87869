// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The one header of export/ that includes OpenVDB: for its own .cc files that make grids.

#include "export/scene/exportable_scene.h"
#include "export/volume/voxelizer.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

namespace semfoam {

// Registers OpenVDB's types; to be called before anything else of it.
void InitializeOpenVdb();

// What one cell gives to the grids: values of the world (COLMAP) frame, colour in linear light.
struct CellValues {
  float density = 0;  // extinction per world unit
  openvdb::Vec3s color{0.f};
  float confidence = 0;
};

// The labels that cells give to voxels.
struct VoxelLabels {
  std::span<const LabelId> by_cell;  // empty: `of_all` is that of every cell
  LabelId of_all = kNoObject;

  LabelId Of(uint32_t cell) const { return by_cell.empty() ? of_all : by_cell[cell]; }
};

// In which types labels are wanted.
struct LabelGrids {
  bool label = true;
  bool label_int32 = false;
};

// Grids with the same active voxels, without names and transforms; null where not wanted.
struct VoxelGrids {
  openvdb::FloatGrid::Ptr density, label, confidence;
  openvdb::Vec3SGrid::Ptr color;
  openvdb::Int32Grid::Ptr label_int32;
  int64_t num_voxels = 0;
};

// The voxels of `voxelizer`, each with what its cell gives (`values`, by cell), or its samples
// together (VolumeExportOptions::supersample). Calls progress(share), one call at a time from any
// thread, if there is one. Same grids on any number of threads.
VoxelGrids MakeVoxelGrids(const CellVoxelizer& voxelizer,
                          const std::vector<CellValues>& values,
                          const VoxelLabels& labels,
                          const LabelGrids& wanted,
                          const std::function<void(double)>& progress);

// The narrow-band level set of the object's surface (ExtractSurface), cut to `box` (normalised
// frame) where the object reaches out of it: class level set, half width 3 voxels, distances in
// the unit in which a voxel is `voxel_size` long, negative inside, without a name and a transform.
// The distance is the one to the nearest triangle, in the whole band, or to the cut; the sign of a
// voxel is that of the cell that holds its centre, so that the grid agrees with the others of the
// object's file to the voxel, in sheets and spikes thinner than a voxel, too. Same bytes on any
// number of threads.
//
// Not by openvdb::tools::meshToVolume, which hands nearest triangles from voxel to voxel: its
// distances beyond the first voxel are up to 0.9 voxels off on surfaces of cells, and where two
// triangles are equally near, depend on the threads.
openvdb::FloatGrid::Ptr MakeSurfaceLevelSet(const ExportableScene& scene,
                                            const ObjectInfo& object,
                                            const VoxelLattice& lattice,
                                            const Eigen::AlignedBox3d& box,
                                            double voxel_size);

// A point for the site of every cell in `cells`, with the float attributes "density",
// "confidence", "radius" (of the cell, in world units), "color" (vec3s), and the int32 "label" (of
// the cell's own class) and "object" (id of the object that it is part of, 0 = none). `values` is
// indexed by cell. A position is kept relative to a voxel of `world_from_index`, so that an offset
// of the world costs it nothing.
openvdb::points::PointDataGrid::Ptr MakePointGrid(const ExportableScene& scene,
                                                  const std::vector<uint32_t>& cells,
                                                  const std::vector<CellValues>& values,
                                                  const VoxelLattice& lattice,
                                                  const openvdb::math::Transform& world_from_index);

// Write one file by OutputFile's rules; same grids, same bytes. Throw UserError when it cannot be
// written completely.
void WriteVdb(const std::filesystem::path& path,
              const openvdb::GridPtrVec& grids,
              const openvdb::MetaMap& metadata);
void WriteNanoVdb(const std::filesystem::path& path, const openvdb::GridPtrVec& grids);

}  // namespace semfoam
