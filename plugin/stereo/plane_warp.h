// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"
#include "plugin/stereo/window_correlation.h"

#include <Eigen/Core>

namespace semfoam {

// What other views show of planes (Hartley and Zisserman, Multiple View Geometry, 13.1).

// Maps pixels (x, y) of a view to pixels of another by way of planes on which the inverse depth of
// a pixel is a linear function of it: hnormalized((turn + shift * plane^T) * (x, y, 1)) for
// plane.dot((x, y, 1)), which is (0, 0, w) where all of it has the inverse depth w.
class PlaneWarp {
 public:
  PlaneWarp(const StereoView& from, const StereoView& to);

  // Samples `to`, between its pixels, for each pixel of a view of `width` x `height`; NaN where it
  // does not show the plane.
  void Warp(const Eigen::Vector3f& plane,
            int width,
            int height,
            const StereoView& to,
            ImageValues* warped) const;

 private:
  Eigen::Matrix3f turn_;
  Eigen::Vector3f shift_;
};

}  // namespace semfoam
