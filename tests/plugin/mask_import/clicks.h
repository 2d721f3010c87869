// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "plugin/mask_import/pixel_runs.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace semfoam {

// Returns where a careful person would click on a thing of a mask: at the pixel farthest from its
// border, then at pixels that are at least 0.3 times as far from it, each the farthest from the
// clicks before it; their centres. Distances to the border are city-block ones. Empty where it has
// fewer than 30 pixels.
inline std::vector<PolygonPoint> ClicksOn(const LabelImage& mask, int id, size_t count) {
  const int width = mask.width, height = mask.height;
  std::vector<int> distance(mask.data.size());
  const auto at = [&](int x, int y) {
    return x < 0 || y < 0 || x >= width || y >= height ? 0 : distance[y * width + x];
  };
  int num_pixels = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (mask.data[y * width + x] != id) continue;
      ++num_pixels;
      distance[y * width + x] = 1 + std::min(at(x - 1, y), at(x, y - 1));
    }
  }
  int farthest = 0;
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      int& of_pixel = distance[y * width + x];
      of_pixel = std::min(of_pixel, 1 + std::min(at(x + 1, y), at(x, y + 1)));
      farthest = std::max(farthest, of_pixel);
    }
  }
  std::vector<PolygonPoint> clicks;
  if (num_pixels < 30) return clicks;
  while (clicks.size() < count) {
    double most = 0;
    PolygonPoint best;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int of_pixel = distance[y * width + x];
        if (of_pixel == 0 || 10 * of_pixel < 3 * farthest) continue;
        double apart = clicks.empty() ? of_pixel : std::numeric_limits<double>::infinity();
        for (const PolygonPoint& click : clicks) {
          const double dx = x + 0.5 - click.x, dy = y + 0.5 - click.y;
          apart = std::min(apart, dx * dx + dy * dy);
        }
        if (apart <= most) continue;
        most = apart;
        best = {x + 0.5, y + 0.5};
      }
    }
    if (most == 0) break;
    clicks.push_back(best);
  }
  return clicks;
}

}  // namespace semfoam
