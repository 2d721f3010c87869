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

// How far surfaces are from where they should be, in any workspace: the SfM points say where the
// camera of a held-out photo first meets something. They were triangulated from held-out photos
// too, and training begins with cells around them; so this measures what training made of the
// surfaces, and how exports keep them, rather than what it found by itself.

// The points that one photo saw, as rays from its camera. Normalised frame.
struct DepthView {
  Eigen::Vector3d origin;
  std::vector<Eigen::Vector3f> directions;  // unit length
  std::vector<double> distances;            // to the points, along these
};

// One for each held-out photo that saw any. Points that are not finite are left out.
std::vector<DepthView> MakeDepthViews(const Reconstruction& reconstruction,
                                      const std::vector<PhotoRecord>& photos,
                                      const Similarity& world_from_normalized);

// Without the points outside `box` (normalised frame), and views that have no others.
std::vector<DepthView> Within(const std::vector<DepthView>& views, const Eigen::AlignedBox3d& box);

// The distances along a view's rays at which something is met; 0 where nothing is.
using DistancesOf = std::function<std::vector<float>(const DepthView& view)>;

// Of the foam itself: where half of the light is lost.
std::vector<float> FoamDistances(const ViewRenderer& renderer, const DepthView& view);
// Of the `cells` surfaces of the objects: where a ray first enters a cell of an object.
std::vector<float> CellSurfaceDistances(const ViewRenderer& renderer,
                                        const ExportableScene& scene,
                                        const DepthView& view);
// Of the scene's volume: where half of the light is lost in its voxels. `min_optical_depth` as in
// VolumeExportOptions.
std::vector<float> VolumeDistances(const ExportableScene& scene,
                                   const VolumeFrame& frame,
                                   float min_optical_depth,
                                   const DepthView& view);

// The median over all rays of |distance met - distance to the point|, normalised frame; infinity
// for rays that meet nothing, NaN where there are no rays.
double SurfaceError(const std::vector<DepthView>& views, const DistancesOf& distances_of);

}  // namespace semfoam
