// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/volume/volume_extent.h"
#include "export/volume/volume_options.h"

#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// What the plan of a volume (volume_extent.h) needs of its cells: all in the normalised frame. So
// volumes can also be planned for cells that are not all in memory.
struct CellExtents {
  std::vector<Eigen::Vector3f> sites;
  // ExportableScene::radius and volume.
  std::vector<float> radii;
  std::vector<double> volumes;
  // CellBox in all of space.
  std::vector<Eigen::AlignedBox3d> boxes;
};

CellExtents ExtentsOf(const ExportableScene& scene, const std::vector<uint32_t>& cells);

// Returns whether a cell is one of those that determine the frame of the volumes. If there is none,
// all do.
bool DeterminesFrame(const ExportableScene& scene, uint32_t cell);

// Do as the functions of volume_extent.h; of `scene` they read only the frames. PlaceObject sets
// lattice and box.
VolumeFrame MakeVolumeFrame(const CellExtents& cells,
                            const ExportableScene& scene,
                            const VolumeExportOptions& options);
void PlaceObject(const CellExtents& cells,
                 const ExportableScene& scene,
                 const VolumeFrame& frame,
                 const VolumeExportOptions& options,
                 Volume* volume);
void CheckVolumeSize(const std::filesystem::path& path,
                     const CellExtents& cells,
                     const ExportableScene& scene,
                     const Volume& volume,
                     const VolumeExportOptions& options);

}  // namespace semfoam
