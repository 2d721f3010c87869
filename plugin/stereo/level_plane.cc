// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/level_plane.h"

#include <algorithm>
#include <cstddef>

namespace semfoam {

Eigen::Vector3d LevelPlane::InImage(const StereoView& view) const {
  const Eigen::Vector3d in_view = view.cam_from_world * up;
  const double height = HeightOf(view.origin);
  const Eigen::Vector2d slope = -in_view.head<2>().cwiseQuotient(view.focal);
  return Eigen::Vector3d(slope.x(), slope.y(), -in_view.z() - slope.dot(view.center)) / height;
}

void SetOnPlane(const std::vector<uint8_t>& is_on_plane,
                int reduction,
                const StereoView& view,
                const LevelPlane& plane,
                DepthMap* map) {
  const Eigen::Vector3d in_image = plane.InImage(view);
  const int width = view.width / reduction, height = view.height / reduction;
  for (int y = 0; y < reduction * height; ++y) {
    for (int x = 0; x < reduction * width; ++x) {
      const size_t at = static_cast<size_t>(y) * view.width + x;
      const size_t reduced_at = static_cast<size_t>(y / reduction) * width + x / reduction;
      if (map->inverse[at] > 0 || is_on_plane[reduced_at] == 0) continue;
      map->inverse[at] =
          static_cast<float>(std::max(0.0, in_image.dot(view.CenterOf(at).homogeneous())));
    }
  }
}

}  // namespace semfoam
