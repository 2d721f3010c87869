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

// One volume to be made: its cells (ascending) on its lattice, within its box (normalised frame).
struct Volume {
  const ObjectInfo* object = nullptr;  // null = the scene
  std::vector<uint32_t> cells;
  VoxelLattice lattice;
  Eigen::AlignedBox3d box;
};

// All of the object's cells, within the robust box of their sites and on the scene's lattice,
// halved until the object is at least max_resolution / 2 voxels long: every voxel of the scene
// holds 2^3, 4^3, ... of the object's exactly. WriteObjectVolume says which cells are too far.
Volume ObjectVolume(const ExportableScene& scene,
                    const ObjectInfo& object,
                    const VolumeFrame& frame,
                    const VolumeExportOptions& options);

// The farthest voxel from a lattice's origin that a volume may have, along an axis.
inline constexpr double kMaxVoxelIndex = 1 << 22;

// Refuses a volume that would not fit, before any of it is made: throws UserError, which names
// `path`, the number of voxels and the voxel size that would be right.
void CheckVolumeSize(const std::filesystem::path& path,
                     const ExportableScene& scene,
                     const Volume& volume,
                     const VolumeExportOptions& options);

}  // namespace semfoam
