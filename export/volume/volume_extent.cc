// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/volume_extent.h"

#include "export/volume/cell_extents.h"
#include "foam/util/error.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// What is left of a box of the normalised frame.
Eigen::AlignedBox3d Cropped(const Eigen::AlignedBox3d& box,
                            const ExportableScene& scene,
                            const VolumeExportOptions& options) {
  const std::optional<Eigen::AlignedBox3d> crop = ParseCrop(options.crop);
  if (!crop) return box;
  return box.intersection(Eigen::AlignedBox3d(scene.colmap_from_normalized.Invert(crop->min()),
                                              scene.colmap_from_normalized.Invert(crop->max())));
}

// Per axis the range between the quantiles q and 1 - q, widened by `fence` times itself, within
// the range of all positions; then `margin` more on every side.
Eigen::AlignedBox3d RobustBox(const CellExtents& cells, double q, double fence, double margin) {
  Eigen::AlignedBox3d box;
  if (cells.sites.empty()) return box;
  std::vector<double> values(cells.sites.size());
  const size_t rank = static_cast<size_t>(q * static_cast<double>(values.size() - 1));
  for (int a = 0; a < 3; ++a) {
    for (size_t k = 0; k < values.size(); ++k) values[k] = cells.sites[k][a];
    std::sort(values.begin(), values.end());
    const double from = values[rank];
    const double to = values[values.size() - 1 - rank];
    box.min()[a] = std::max(values.front(), from - fence * (to - from)) - margin;
    box.max()[a] = std::min(values.back(), to + fence * (to - from)) + margin;
  }
  return box;
}

double MedianRadius(const CellExtents& cells) { return Median(cells.radii); }

// Returns about how much of the box the cells fill, normalised frame: cells reach out of it, but
// not by more than their own boxes say.
double FilledVolume(const CellExtents& cells, const Eigen::AlignedBox3d& box) {
  double filled = 0;
  for (size_t k = 0; k < cells.boxes.size(); ++k) {
    const Eigen::AlignedBox3d around = cells.boxes[k].intersection(box);
    if (!around.isEmpty()) filled += std::min(cells.volumes[k], around.volume());
  }
  return std::min(filled, box.volume());
}

// Returns the scene's lattice, halved until the object is at least max_resolution / 2 voxels long:
// every voxel of the scene holds 2^3, 4^3, ... of the object's exactly.
VoxelLattice ObjectLattice(const CellExtents& cells,
                           const Eigen::AlignedBox3d& box,
                           const VolumeFrame& frame,
                           const VolumeExportOptions& options) {
  VoxelLattice lattice = frame.lattice;
  if (options.voxel_size > 0) return lattice;
  // An object of one cell is as long as that.
  const double length =
      std::max(RobustBox(cells, 0.05, 0, 0).sizes().maxCoeff(), 2 * MedianRadius(cells));
  const double edge = 0.5 * options.max_resolution;
  const double filled = FilledVolume(cells, box);
  constexpr int kMaxHalvings = 12;
  for (int halvings = 0; halvings < kMaxHalvings; ++halvings) {
    const double halved = 0.5 * lattice.voxel_size;
    if (!(length > 0) || length >= edge * lattice.voxel_size) break;
    if (filled > std::pow(edge * halved, 3)) break;
    lattice.voxel_size *= 0.5;
    lattice.origin.array() -=
        0.5 * lattice.voxel_size;  // from the centre of eight to that of the first
  }
  return lattice;
}

}  // namespace

CellExtents ExtentsOf(const ExportableScene& scene, const std::vector<uint32_t>& cells) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::AlignedBox3d everything(Eigen::Vector3d::Constant(-kInfinity),
                                       Eigen::Vector3d::Constant(kInfinity));
  CellExtents extents;
  for (const uint32_t cell : cells) {
    extents.sites.push_back(scene.cell_positions[cell]);
    extents.radii.push_back(scene.radius[cell]);
    extents.volumes.push_back(scene.volume[cell]);
    extents.boxes.push_back(CellBox(scene, cell, everything));
  }
  return extents;
}

bool DeterminesFrame(const ExportableScene& scene, uint32_t cell) {
  return scene.labels.solid[cell] && scene.photographed[cell];
}

VolumeFrame MakeVolumeFrame(const ExportableScene& scene, const VolumeExportOptions& options) {
  std::vector<uint32_t> cells;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    if (DeterminesFrame(scene, i)) cells.push_back(i);
  }
  if (cells.empty()) {
    // Nothing solid: the box of everything, so that the file is valid and says where the scene is.
    cells.resize(scene.NumSites());
    std::iota(cells.begin(), cells.end(), 0u);
  }
  return MakeVolumeFrame(ExtentsOf(scene, cells), scene, options);
}

VolumeFrame MakeVolumeFrame(const CellExtents& cells,
                            const ExportableScene& scene,
                            const VolumeExportOptions& options) {
  CHECK_EQ(options.Check(), "");
  VolumeFrame frame;
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  double edge = 1;
  if (!cells.sites.empty()) {
    const Eigen::AlignedBox3d whole = RobustBox(cells, 0.01, 0.05, MedianRadius(cells));
    corner = whole.min();
    frame.box = Cropped(whole, scene, options);
    edge = (frame.box.isEmpty() ? whole : frame.box).sizes().maxCoeff();
  }
  if (options.voxel_size > 0) {
    frame.lattice.voxel_size = options.voxel_size / scene.world_from_normalized.scale;
  } else {
    frame.lattice.voxel_size = edge > 0 ? edge / options.max_resolution : 1;
  }
  frame.lattice.origin = corner + Eigen::Vector3d::Constant(0.5 * frame.lattice.voxel_size);
  return frame;
}

Volume ObjectVolume(const ExportableScene& scene,
                    const ObjectInfo& object,
                    const VolumeFrame& frame,
                    const VolumeExportOptions& options) {
  Volume volume;
  volume.object = &object;
  volume.cells = object.cells;
  PlaceObject(ExtentsOf(scene, object.cells), scene, frame, options, &volume);
  return volume;
}

void PlaceObject(const CellExtents& cells,
                 const ExportableScene& scene,
                 const VolumeFrame& frame,
                 const VolumeExportOptions& options,
                 Volume* volume) {
  volume->lattice = frame.lattice;
  if (frame.box.isEmpty()) return;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.1 * frame.box.sizes().maxCoeff());
  const Eigen::AlignedBox3d reach(frame.box.min() - margin, frame.box.max() + margin);
  volume->box = Cropped(
      RobustBox(cells, 0.05, 1, 4 * MedianRadius(cells)).intersection(reach), scene, options);
  volume->lattice = ObjectLattice(cells, volume->box, frame, options);
}

void CheckVolumeSize(const std::filesystem::path& path,
                     const ExportableScene& scene,
                     const Volume& volume,
                     const VolumeExportOptions& options) {
  CheckVolumeSize(path, ExtentsOf(scene, volume.cells), scene, volume, options);
}

void CheckVolumeSize(const std::filesystem::path& path,
                     const CellExtents& cells,
                     const ExportableScene& scene,
                     const Volume& volume,
                     const VolumeExportOptions& options) {
  const Eigen::AlignedBox3d& box = volume.box;
  if (box.isEmpty()) return;
  const double voxel = volume.lattice.voxel_size;
  const double voxels = FilledVolume(cells, box) / (voxel * voxel * voxel);
  const Eigen::Vector3d reach = (box.max() - volume.lattice.origin)
                                    .cwiseAbs()
                                    .cwiseMax((box.min() - volume.lattice.origin).cwiseAbs());
  const double scale = std::max(std::cbrt(voxels / static_cast<double>(options.max_voxels)),
                                reach.maxCoeff() / voxel / kMaxVoxelIndex);
  if (scale > 1) {
    const double world_voxel = voxel * scene.world_from_normalized.scale;
    throw UserError(path.string(),
                    ": with voxels of ",
                    world_voxel,
                    " it would hold about ",
                    voxels,
                    " of them, more than the ",
                    options.max_voxels,
                    " allowed; choose a voxel size of ",
                    world_voxel * scale * 1.01,
                    " or more.");
  }
}

}  // namespace semfoam
