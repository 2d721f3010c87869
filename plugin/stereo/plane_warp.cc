// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/plane_warp.h"

#include <limits>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

Eigen::Matrix3d Calibration(const StereoView& view) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = view.focal.x();
  k(1, 1) = view.focal.y();
  k.topRightCorner<2, 1>() = view.center;
  return k;
}

}  // namespace

PlaneWarp::PlaneWarp(const StereoView& from, const StereoView& to) {
  const Eigen::Matrix3d to_from = to.cam_from_world * from.cam_from_world.transpose();
  turn_ = (Calibration(to) * to_from * Calibration(from).inverse()).cast<float>();
  shift_ = (Calibration(to) * (to.cam_from_world * (from.origin - to.origin))).cast<float>();
}

void PlaneWarp::Warp(const Eigen::Vector3f& plane,
                     int width,
                     int height,
                     const StereoView& to,
                     ImageValues* warped) const {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> us(width), vs(width);
  const Eigen::Vector3f step = turn_.col(0) + plane.x() * shift_;
  // Pixel centres of `to` are half a pixel from its corners.
  const auto last_u = static_cast<float>(to.width - 1);
  const auto last_v = static_cast<float>(to.height - 1);
  const float* grey = to.grey.data();
  for (int y = 0; y < height; ++y) {
    const Eigen::Vector3f first(0.5f, static_cast<float>(y) + 0.5f, 1);
    const Eigen::Vector3f begin = turn_ * first + plane.dot(first) * shift_;
    for (int x = 0; x < width; ++x) {
      const auto along = static_cast<float>(x);
      const float z = begin.z() + along * step.z();
      const float scale = z > 1e-6f ? 1 / z : nan;
      us[x] = (begin.x() + along * step.x()) * scale - 0.5f;
      vs[x] = (begin.y() + along * step.y()) * scale - 0.5f;
    }
    float* out = &(*warped)[static_cast<size_t>(y) * width];
    for (int x = 0; x < width; ++x) {
      const float u = us[x], v = vs[x];
      if (!(u >= 0 && v >= 0 && u < last_u && v < last_v)) {
        out[x] = nan;
        continue;
      }
      const int left = static_cast<int>(u), top = static_cast<int>(v);
      const float a = u - static_cast<float>(left), b = v - static_cast<float>(top);
      const float* at = grey + static_cast<size_t>(top) * to.width + left;
      const float upper = at[0] + a * (at[1] - at[0]);
      const float lower = at[to.width] + a * (at[to.width + 1] - at[to.width]);
      out[x] = upper + b * (lower - upper);
    }
  }
}

}  // namespace semfoam
