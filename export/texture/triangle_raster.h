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

// Calls visit(x, y, weights) for each pixel of the image whose centre the triangle covers, with the
// weights of its corners.
template <typename Visit>
void ForEachCoveredPixel(const std::array<Eigen::Vector2d, 3>& corners,
                         int width,
                         int height,
                         const Visit& visit) {
  const Eigen::Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
  const Eigen::Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  if (!(high.x() >= 0.5 && high.y() >= 0.5 && low.x() <= width && low.y() <= height)) return;
  const Eigen::Vector2d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  const double area = ab.x() * ac.y() - ab.y() * ac.x();
  if (area == 0) return;
  const auto first = [](double from) {
    return static_cast<int>(std::ceil(std::max(0.0, from - 0.5)));
  };
  const auto last = [](double to, int size) {
    return static_cast<int>(std::floor(std::min(size - 1.0, to - 0.5)));
  };
  for (int y = first(low.y()), end_y = last(high.y(), height); y <= end_y; ++y) {
    for (int x = first(low.x()), end_x = last(high.x(), width); x <= end_x; ++x) {
      const Eigen::Vector2d d = Eigen::Vector2d(x + 0.5, y + 0.5) - corners[0];
      const double b = (d.x() * ac.y() - d.y() * ac.x()) / area;
      const double c = (ab.x() * d.y() - ab.y() * d.x()) / area;
      if (b < 0 || c < 0 || b + c > 1) continue;
      visit(x, y, Eigen::Vector3d(1 - b - c, b, c));
    }
  }
}

}  // namespace semfoam
