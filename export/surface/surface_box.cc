// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_box.h"

#include "foam/util/median.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace semfoam {
namespace {

constexpr double kLeftOut = 0.01;
constexpr double kMargin = 0.1;
constexpr double kFar = 0.25;

}  // namespace

Eigen::AlignedBox3d WholeSpace() {
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  return {-far, far};
}

Eigen::AlignedBox3d SurfaceBox(const ExportableScene& scene, const std::vector<uint32_t>& cells) {
  Eigen::AlignedBox3d box = WholeSpace();
  std::vector<uint32_t> shown;
  for (const uint32_t cell : cells) {
    if (scene.photographed[cell]) shown.push_back(cell);
  }
  if (shown.empty()) return box;
  std::vector<double> radii;
  for (const uint32_t cell : shown) radii.push_back(scene.radius[cell]);
  const double radius = Median(std::move(radii));
  std::vector<double> places(shown.size());
  const auto rank = static_cast<size_t>(kLeftOut * static_cast<double>(shown.size() - 1));
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t k = 0; k < shown.size(); ++k) places[k] = scene.cell_positions[shown[k]][axis];
    std::sort(places.begin(), places.end());
    const double from = places[rank], to = places[places.size() - 1 - rank];
    const double margin = std::max(kMargin * (to - from), radius);
    const double far = std::max(kFar * (to - from), 2 * radius);
    double low = from, high = to;
    for (const uint32_t cell : cells) {
      low = std::min<double>(low, scene.cell_positions[cell][axis]);
      high = std::max<double>(high, scene.cell_positions[cell][axis]);
    }
    if (low < from - far) box.min()[axis] = from - margin;
    if (high > to + far) box.max()[axis] = to + margin;
  }
  return box;
}

std::vector<uint32_t> CellsInBox(const ExportableScene& scene,
                                 const std::vector<uint32_t>& cells,
                                 const Eigen::AlignedBox3d& box) {
  std::vector<uint32_t> within;
  for (const uint32_t cell : cells) {
    if (box.contains(scene.cell_positions[cell].cast<double>())) within.push_back(cell);
  }
  return within;
}

}  // namespace semfoam
