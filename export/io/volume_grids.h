// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Makes the grids of a volume's file in two steps: their voxels, which need the cells, and what the
// file says of itself. For the .cc files of export/io and export/blocks, as it includes OpenVDB.

#include "export/io/volume_export.h"
#include "export/volume/vdb_grids.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

namespace semfoam {

// The grids of one volume, complete.
struct VolumeGrids {
  openvdb::GridPtrVec grids;
  // Written to a separate file; null if not requested.
  openvdb::Int32Grid::Ptr label_int32;
  openvdb::MetaMap metadata;
  int64_t voxels = 0;
};

// Returns the grids of labels in the volume of the scene, or of an object.
LabelGrids WantedLabels(bool is_scene, const VolumeExportOptions& options);

// Makes voxels of the cells of a scene. Keeps references to both arguments.
class VolumeCells {
 public:
  VolumeCells(const ExportableScene& scene, const VolumeExportOptions& options);

  // Returns the objects that have a volume.
  const std::vector<const ObjectInfo*>& objects() const { return objects_; }
  // [NumSites()] The values of the cells' voxels.
  const std::vector<CellValues>& values() const { return values_; }
  // Returns the cells of the scene's volume, ascending.
  std::vector<uint32_t> CellsOfScene() const;

  // Returns the voxels of a volume. Calls progress(share), one call at a time, if there is one.
  VoxelGrids Voxels(const Volume& volume, const std::function<void(double)>& progress) const;

 private:
  const ExportableScene& scene_;
  const VolumeExportOptions& options_;
  std::vector<const ObjectInfo*> objects_;
  std::vector<CellValues> values_;  // by cell
  std::vector<LabelId> labels_;     // by cell: in the files of the scene
};

// Completes the grids of volumes, and writes them. Of the scene it reads frames and labels alone.
// Keeps references to both arguments.
class VolumeFinisher {
 public:
  VolumeFinisher(const ExportableScene& scene, const VolumeExportOptions& options)
      : scene_(scene), options_(options) {}

  // Returns the transform of the grids of a lattice.
  openvdb::math::Transform::Ptr WorldFromIndex(const VoxelLattice& lattice) const;
  // Returns the edge of a voxel in the frame of the file.
  double VoxelSize(const Volume& volume) const;
  // Returns what every file and every grid says of itself (export/README.md).
  openvdb::MetaMap Metadata(const Volume& volume) const;

  // Names a grid and gives it transform and metadata.
  void Finish(const std::string& quantity,
              const std::string& name,
              const Volume& volume,
              const openvdb::MetaMap& metadata,
              openvdb::GridBase* grid) const;
  // Returns the complete grids of a volume. `surface` is the level set of an object; null for the
  // scene.
  VolumeGrids Finish(const Volume& volume,
                     const VoxelGrids& voxels,
                     const openvdb::FloatGrid::Ptr& surface) const;

  // Writes the .vdb, and the .nvdb beside it if it is wanted.
  void WriteFiles(const std::filesystem::path& path,
                  const openvdb::GridPtrVec& grids,
                  const openvdb::MetaMap& metadata) const;
  // Returns one sentence for a volume of hardly any voxel; else nothing.
  std::string Warning(const Volume& volume, int64_t voxels) const;

 private:
  const ExportableScene& scene_;
  const VolumeExportOptions& options_;
};

}  // namespace semfoam
