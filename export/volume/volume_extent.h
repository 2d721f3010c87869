// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/volume/volume_options.h"
#include "export/volume/voxelizer.h"

#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// The lattice of the scene's volume, and the box of scene.vdb. The box is the robust extent of the
// solid, photographed cells: per axis from the 1 % to the 99 % quantile of their sites, 5 % wider
// on either side but never wider than the sites themselves, so that a few far cells do not
// determine the voxel size; it is clipped to options.crop, which never moves the lattice: with the
// same voxel_size, neighbouring crops fit together. Empty where the crop does not intersect it.
struct VolumeFrame {
  // Both in the normalised frame.
  VoxelLattice lattice;
  Eigen::AlignedBox3d box;
};
VolumeFrame MakeVolumeFrame(const ExportableScene& scene, const VolumeExportOptions& options);

// The plan of one volume: its cells (ascending), its lattice, and its box (normalised frame).
struct Volume {
  // Null: the scene.
  const ObjectInfo* object = nullptr;
  std::vector<uint32_t> cells;
  VoxelLattice lattice;
  Eigen::AlignedBox3d box;
};

// Plans the volume of an object: all of its cells, within the robust box of their sites
// (WriteObjectVolume has the rule), on the scene's lattice with the voxels halved until the object
// is at least max_resolution / 2 voxels long: every voxel of the scene holds exactly 2^3, 4^3, ...
// voxels of the object.
Volume ObjectVolume(const ExportableScene& scene,
                    const ObjectInfo& object,
                    const VolumeFrame& frame,
                    const VolumeExportOptions& options);

// Maximum distance of a voxel from a lattice's origin along an axis, in voxels.
inline constexpr double kMaxVoxelIndex = 1 << 22;

// Throws UserError if a volume would have too many voxels, before any of it is made. The message
// names `path`, the number of voxels and the voxel size that would be right.
void CheckVolumeSize(const std::filesystem::path& path,
                     const ExportableScene& scene,
                     const Volume& volume,
                     const VolumeExportOptions& options);

}  // namespace semfoam
