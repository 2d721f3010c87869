// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/colmap_model.h"

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Measures the error of surfaces in any workspace: the distances of SfM points from the cameras of
// held-out photos are compared with those of the surfaces along the same rays. The points were
// triangulated from held-out photos too, and training starts with cells around them; so this
// measures how training and exports preserve these surfaces, not how training finds surfaces by
// itself.

// The points that one photo observes, as rays from its camera. Normalised frame.
struct DepthView {
  Eigen::Vector3d origin;
  // Unit length.
  std::vector<Eigen::Vector3f> directions;
  // Distances to the points along these.
  std::vector<double> distances;
};

// Makes one view for each held-out photo that observes points. Leaves out points that are not
// finite.
std::vector<DepthView> MakeDepthViews(const Reconstruction& reconstruction,
                                      const std::vector<PhotoRecord>& photos,
                                      const Similarity& world_from_normalized);

// Returns the views without the points outside of `box` (normalised frame), and without views that
// have no others.
std::vector<DepthView> Within(const std::vector<DepthView>& views, const Eigen::AlignedBox3d& box);

// Returns the distances of a surface along a view's rays; 0 where a ray does not meet it.
using DistancesOf = std::function<std::vector<float>(const DepthView& view)>;

// Returns the distances of the foam itself: where the transmittance falls to 1/2.
std::vector<float> FoamDistances(const ViewRenderer& renderer, const DepthView& view);
// Returns the distances of the `cells` surfaces of the objects: where a ray first enters a cell of
// an object.
std::vector<float> CellSurfaceDistances(const ViewRenderer& renderer,
                                        const ExportableScene& scene,
                                        const DepthView& view);
// Returns the distances of the scene's volume: where the transmittance through its voxels falls to
// 1/2. `min_optical_depth` is that of VolumeExportOptions.
std::vector<float> VolumeDistances(const ExportableScene& scene,
                                   const VolumeFrame& frame,
                                   float min_optical_depth,
                                   const DepthView& view);

// Returns the median over all rays of |distance of the surface - distance of the point|, normalised
// frame; rays that do not meet the surface count as infinity. NaN without rays.
double SurfaceError(const std::vector<DepthView>& views, const DistancesOf& distances_of);

}  // namespace semfoam
