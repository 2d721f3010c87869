// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/plain_regions.h"

#include <cstddef>
#include <cstdint>

namespace semfoam {
namespace {

// Largest difference of display values between neighbours in a region.
constexpr float kColorStep = 0.04f;

}  // namespace

PlainRegions FindPlainRegions(const ReducedView& reduced) {
  const int width = reduced.view.width, height = reduced.view.height;
  const std::vector<Eigen::Vector3f>& color = reduced.view.color;
  PlainRegions regions;
  regions.of_pixel.assign(color.size(), -1);
  std::vector<size_t> open;
  for (size_t first = 0; first < color.size(); ++first) {
    if (regions.of_pixel[first] >= 0 || reduced.is_unknown[first] == 0) continue;
    const auto region = static_cast<int>(regions.sizes.size());
    regions.sizes.push_back(0);
    regions.of_pixel[first] = region;
    open.push_back(first);
    while (!open.empty()) {
      const size_t at = open.back();
      open.pop_back();
      ++regions.sizes[region];
      const int x = static_cast<int>(at % width), y = static_cast<int>(at / width);
      const auto visit = [&](size_t next) {
        if (regions.of_pixel[next] >= 0 || reduced.is_unknown[next] == 0) return;
        if ((color[next] - color[at]).cwiseAbs().maxCoeff() > kColorStep) return;
        regions.of_pixel[next] = region;
        open.push_back(next);
      };
      if (x > 0) visit(at - 1);
      if (x + 1 < width) visit(at + 1);
      if (y > 0) visit(at - width);
      if (y + 1 < height) visit(at + width);
    }
  }
  return regions;
}

bool SampleUnknown(const ReducedView& reduced,
                   const Eigen::Vector3d& offset,
                   Eigen::Vector3f* color) {
  const StereoView& view = reduced.view;
  Eigen::Vector2d pixel;
  double depth = 0;
  if (!view.Project(view.origin + offset, &pixel, &depth)) return false;
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 0 && v >= 0 && u < view.width - 1 && v < view.height - 1)) return false;
  const int left = static_cast<int>(u), top = static_cast<int>(v);
  const size_t upper = static_cast<size_t>(top) * view.width + left, lower = upper + view.width;
  const std::vector<uint8_t>& is_unknown = reduced.is_unknown;
  if (!(is_unknown[upper] && is_unknown[upper + 1] && is_unknown[lower] && is_unknown[lower + 1])) {
    return false;
  }
  const auto a = static_cast<float>(u - left), b = static_cast<float>(v - top);
  *color = (1 - b) * ((1 - a) * view.color[upper] + a * view.color[upper + 1]) +
           b * ((1 - a) * view.color[lower] + a * view.color[lower + 1]);
  return true;
}

}  // namespace semfoam
