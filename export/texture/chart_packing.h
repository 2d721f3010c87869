// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Texels between a chart and the border of its rectangle, so that interpolation and smaller copies
// of the texture do not mix charts.
inline constexpr int kChartMargin = 3;

// The least edge of a texture.
inline constexpr int kLeastTextureSize = 64;

// Rectangles of charts placed in a square texture.
struct ChartPacking {
  // Edge of the texture, in texels.
  int size = 0;
  // Texels per unit of the charts.
  double scale = 0;
  // [charts] Place of the layout's (0, 0), in texels, kChartMargin inside of the rectangle.
  std::vector<Eigen::Vector2d> offsets;
};

// Packs charts of the given sizes (in any unit) into a square of at most `most_size` texels: at
// `wanted_scale` texels a unit into the smallest power of two that holds them, or `most_size`;
// where that is too small, at the largest scale (in steps of 3 %) that it holds. Places the
// rectangles on a skyline, highest first, each as low as it goes. CHECKs that there are charts and
// most_size >= kLeastTextureSize; with more charts than that holds, margins included, they overlap.
ChartPacking PackCharts(const std::vector<Eigen::Vector2d>& sizes,
                        double wanted_scale,
                        int most_size);

}  // namespace semfoam
