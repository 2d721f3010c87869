// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

inline constexpr uint32_t kNoTriangle = std::numeric_limits<uint32_t>::max();

// A vertex in an image: pixels (the corner of the image is (0, 0)) and the distance from the
// camera's centre; a distance of 0: it has no place in the image.
struct ImageVertex {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double distance = 0;
};

// What is nearest in each pixel, [height][width].
struct TriangleRaster {
  int width = 0;
  int height = 0;
  // kNoTriangle: none.
  std::vector<uint32_t> triangle;
  // Infinite: none.
  std::vector<float> distance;
};

// The weights of the corners of a triangle at a place in its plane; of one without area, those of
// its first corner.
Eigen::Vector3d CornerWeights(const std::array<Eigen::Vector2d, 3>& corners,
                              const Eigen::Vector2d& place);

// Draws triangles: in each pixel whose centre they cover the nearest one, from both sides, by the
// reciprocal of the distance. Triangles with a corner that has no place in the image are left out.
TriangleRaster DrawTriangles(std::span<const ImageVertex> vertices,
                             std::span<const std::array<uint32_t, 3>> triangles,
                             int width,
                             int height);

// Calls visit(x, y, weights) for each pixel with first_row <= y < end_row and 0 <= x < width whose
// centre the triangle covers, with the weights of its corners. The time it takes follows the pixels
// that are covered and not the box around the triangle, which may be far larger than the image.
template <typename Visit>
void ForEachCoveredPixel(const std::array<Eigen::Vector2d, 3>& corners,
                         int width,
                         int first_row,
                         int end_row,
                         const Visit& visit) {
  const Eigen::Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
  const Eigen::Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  if (!(high.x() >= 0.5 && high.y() >= first_row + 0.5 && low.x() <= width && low.y() <= end_row)) {
    return;
  }
  const Eigen::Vector2d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  const double area = ab.x() * ac.y() - ab.y() * ac.x();
  if (area == 0) return;
  const auto first = [](double from, int least) {
    return static_cast<int>(std::ceil(std::max<double>(least, from - 0.5)));
  };
  const auto last = [](double to, int end) {
    return static_cast<int>(std::floor(std::min(end - 1.0, to - 0.5)));
  };
  // Along a row the weights of the second and the third corner change by these a pixel.
  const double step_b = ac.y() / area, step_c = -ab.y() / area;
  for (int y = first(low.y(), first_row), last_y = last(high.y(), end_row); y <= last_y; ++y) {
    const double dy = y + 0.5 - corners[0].y();
    const double begin_b = -dy * ac.x() / area, begin_c = dy * ab.x() / area;
    // The part of the row where no weight is negative, a pixel wider for rounding.
    double left = low.x(), right = high.x();
    const auto keep = [&](double value, double step) {
      const double zero = corners[0].x() - value / step;
      if (step > 0) left = std::max(left, zero - 1);
      if (step < 0) right = std::min(right, zero + 1);
    };
    keep(begin_b, step_b);
    keep(begin_c, step_c);
    keep(1 - begin_b - begin_c, -step_b - step_c);
    for (int x = first(left, 0), last_x = last(right, width); x <= last_x; ++x) {
      const double dx = x + 0.5 - corners[0].x();
      const double b = begin_b + dx * step_b;
      const double c = begin_c + dx * step_c;
      if (b < 0 || c < 0 || b + c > 1) continue;
      visit(x, y, Eigen::Vector3d(1 - b - c, b, c));
    }
  }
}

}  // namespace semfoam
