// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/photo_depths.h"

#include <algorithm>
#include <cstddef>

namespace semfoam {
namespace {

constexpr float kMostDifference = 0.05f;

}  // namespace

float PhotoDepths::DistanceAlong(const Eigen::Vector3f& direction) const {
  if (inverse.empty() || !(direction.z() > 0)) return 0;
  const Eigen::Vector2f at = focal.cwiseProduct(direction.head<2>() / direction.z()) + center -
                             Eigen::Vector2f(0.5f, 0.5f);
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() < static_cast<float>(width - 1) &&
        at.y() < static_cast<float>(height - 1))) {
    return 0;
  }
  const int left = static_cast<int>(at.x()), top = static_cast<int>(at.y());
  const float u = at.x() - static_cast<float>(left), v = at.y() - static_cast<float>(top);
  const float* upper = &inverse[static_cast<size_t>(top) * width + left];
  const float* lower = upper + width;
  const auto [least, most] = std::minmax({upper[0], upper[1], lower[0], lower[1]});
  if (!(least > 0) || most > (1 + kMostDifference) * least) return 0;
  const float above = upper[0] + u * (upper[1] - upper[0]);
  const float below = lower[0] + u * (lower[1] - lower[0]);
  return 1 / ((above + v * (below - above)) * direction.z());
}

}  // namespace semfoam
