// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/triangle_raster.h"

namespace semfoam {

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
  raster.distance.assign(count, std::numeric_limits<float>::infinity());
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
    ForEachCoveredPixel(corners, width, height, [&](int x, int y, const Eigen::Vector3d& weights) {
      const auto distance = static_cast<float>(1 / weights.dot(inverse));
      const size_t at = static_cast<size_t>(y) * width + x;
      if (!(distance < raster.distance[at])) return;
      raster.distance[at] = distance;
      raster.triangle[at] = f;
    });
  }
  return raster;
}

}  // namespace semfoam
