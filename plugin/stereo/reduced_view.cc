// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/reduced_view.h"

#include <cmath>
#include <cstddef>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {

ReducedView Reduce(const StereoView& full, const std::vector<uint8_t>& is_known, int reduction) {
  CHECK_EQ(is_known.size(), full.NumPixels());
  CHECK_GT(reduction, 0);
  const int most_known = reduction * reduction / 8;
  const auto num_pixels = static_cast<float>(reduction * reduction);
  ReducedView reduced;
  StereoView& view = reduced.view;
  view.view = full.view;
  view.width = full.width / reduction;
  view.height = full.height / reduction;
  view.focal = full.focal / reduction;
  view.center = full.center / reduction;
  view.origin = full.origin;
  view.cam_from_world = full.cam_from_world;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      Eigen::Vector3f color = Eigen::Vector3f::Zero();
      float grey = 0;
      int num_known = 0;
      for (int v = reduction * y; v < reduction * (y + 1); ++v) {
        for (int u = reduction * x; u < reduction * (x + 1); ++u) {
          const size_t at = static_cast<size_t>(v) * full.width + u;
          color += full.color[at];
          grey += full.grey[at];
          num_known += is_known[at];
        }
      }
      view.color.push_back(color / num_pixels);
      view.grey.push_back(grey / num_pixels);
      reduced.is_unknown.push_back(num_known <= most_known && !std::isnan(grey));
    }
  }
  return reduced;
}

}  // namespace semfoam
