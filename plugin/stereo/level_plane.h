// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/plane_sweep.h"
#include "plugin/stereo/stereo_view.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A plane below the cameras, such as the ground or a table top: the points x of the normalised
// frame with up.dot(x) == level.
struct LevelPlane {
  // Unit length.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double level = 0;

  double HeightOf(const Eigen::Vector3d& x) const { return up.dot(x) - level; }
  // Returns the inverse depth at which a view sees the plane in pixel p, as a linear function of
  // (p.x, p.y, 1); not positive above the horizon. The view must be above the plane.
  Eigen::Vector3d InImage(const StereoView& view) const;
};

// Sets the unknown depths of a map to those of the plane where `is_on_plane` [pixels of the view
// reduced by `reduction`] (Reduce).
void SetOnPlane(const std::vector<uint8_t>& is_on_plane,
                int reduction,
                const StereoView& view,
                const LevelPlane& plane,
                DepthMap* map);

}  // namespace semfoam
