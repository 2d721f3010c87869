// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/cell_colors.h"

#include "foam/model/spherical_harmonics.h"
#include "foam/render/compositing.h"

#include <algorithm>

namespace semfoam {

std::vector<Eigen::Vector3f> DisplayColors(const Model& model) {
  const Foam& foam = model.foam;
  std::vector<Eigen::Vector3f> colors = model.statistics.mean_color;
  if (colors.empty()) {
    colors.resize(foam.NumSites());
    for (size_t i = 0; i < colors.size(); ++i) {
      colors[i] = Eigen::Vector3f::Constant(0.5f) +
                  static_cast<float>(kShDc) *
                      Eigen::Map<const Eigen::Vector3f>(&foam.sh[i * foam.ShStride()]);
    }
  }
  for (Eigen::Vector3f& color : colors) color = color.cwiseMax(0.f).cwiseMin(1.f);
  return colors;
}

std::vector<float> ColorWeights(const Model& model, const std::vector<uint8_t>& photographed) {
  std::vector<float> weights = model.statistics.contribution;
  if (weights.empty()) return std::vector<float>(model.foam.NumSites(), 1.f);
  for (size_t i = 0; i < weights.size(); ++i) {
    // Not nothing: where only such cells meet, they share the colour.
    if (!photographed[i]) weights[i] = kNegligibleWeight;
  }
  return weights;
}

void SpreadColors(ExportableScene* scene) {
  // Cells whose colour is known, in the order in which they came to it.
  std::vector<uint8_t> known = scene->photographed;
  std::vector<uint32_t> layer;
  for (uint32_t i = 0; i < scene->NumSites(); ++i) {
    if (known[i] && scene->object_of_cell[i] >= 0) layer.push_back(i);
  }
  const auto is_neighbor = [&](uint32_t cell, uint32_t next) {
    return next < scene->NumSites() && scene->object_of_cell[next] == scene->object_of_cell[cell];
  };
  while (!layer.empty()) {
    std::vector<uint32_t> next_layer;
    for (const uint32_t cell : layer) {
      for (const uint32_t next : scene->delaunay.Neighbors(cell)) {
        if (is_neighbor(cell, next) && !known[next]) next_layer.push_back(next);
      }
    }
    std::sort(next_layer.begin(), next_layer.end());
    next_layer.erase(std::unique(next_layer.begin(), next_layer.end()), next_layer.end());
    for (const uint32_t cell : next_layer) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      int count = 0;
      for (const uint32_t next : scene->delaunay.Neighbors(cell)) {
        if (!is_neighbor(cell, next) || !known[next]) continue;
        sum += scene->display_color[next];
        ++count;
      }
      scene->display_color[cell] = sum / static_cast<float>(count);
    }
    for (const uint32_t cell : next_layer) known[cell] = 1;
    layer = std::move(next_layer);
  }
}

}  // namespace semfoam
