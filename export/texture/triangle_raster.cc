// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/triangle_raster.h"

#include "foam/util/parallel.h"

namespace semfoam {
namespace {

// A triangle is looked at once for each block of rows, which costs less than its pixels.
constexpr int64_t kRowsPerBlock = 256;

}  // namespace

Eigen::Vector3d CornerWeights(const std::array<Eigen::Vector2d, 3>& corners,
                              const Eigen::Vector2d& place) {
  const Eigen::Vector2d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  const double area = ab.x() * ac.y() - ab.y() * ac.x();
  if (area == 0) return Eigen::Vector3d::UnitX();
  const Eigen::Vector2d d = place - corners[0];
  const double b = (d.x() * ac.y() - d.y() * ac.x()) / area;
  const double c = (ab.x() * d.y() - ab.y() * d.x()) / area;
  return {1 - b - c, b, c};
}

TriangleRaster DrawTriangles(std::span<const ImageVertex> vertices,
                             std::span<const std::array<uint32_t, 3>> triangles,
                             int width,
                             int height) {
  TriangleRaster raster{width, height, {}, {}};
  const size_t count = static_cast<size_t>(width) * height;
  raster.triangle.assign(count, kNoTriangle);
  // Reciprocals while drawing, since these are linear in an image.
  raster.distance.assign(count, 0);
  ParallelForBlocks(height, kRowsPerBlock, [&](int64_t first_row, int64_t end_row) {
    for (uint32_t f = 0; f < triangles.size(); ++f) {
      std::array<Eigen::Vector2d, 3> corners;
      Eigen::Vector3d inverse;
      bool is_inside = true;
      for (int k = 0; k < 3; ++k) {
        const ImageVertex& vertex = vertices[triangles[f][k]];
        is_inside &= vertex.distance > 0;
        corners[k] = vertex.pixel;
        inverse[k] = 1 / vertex.distance;
      }
      if (!is_inside) continue;
      ForEachCoveredPixel(
          corners, width, first_row, end_row, [&](int x, int y, const Eigen::Vector3d& weights) {
            const auto reciprocal = static_cast<float>(weights.dot(inverse));
            const size_t at = static_cast<size_t>(y) * width + x;
            if (!(reciprocal > raster.distance[at])) return;
            raster.distance[at] = reciprocal;
            raster.triangle[at] = f;
          });
    }
    for (int64_t at = first_row * width; at < end_row * width; ++at) {
      raster.distance[at] = 1 / raster.distance[at];
    }
  });
  return raster;
}

}  // namespace semfoam
