// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/hidden_cells.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/render/color_variation.h"
#include "foam/train/harmonic_extension.h"
#include "foam/util/median.h"

#include <algorithm>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The cells that are hidden or that no ray meets, opaque or not, and the opaque ones beside them
// that photos see.
struct HiddenGraph {
  // Cells of the nodes: first those without a colour.
  std::vector<uint32_t> cells;
  size_t num_without_color = 0;
  // Edges with a cell without a colour at one end at least, all of conductance 1.
  ConductanceGraph graph;
};

// Returns whether the rays that met the cell's neighbours would have met it, too, were it not
// behind them: it is as large as half of these.
bool IsLargeEnoughToMeet(const Delaunay& delaunay,
                         const std::vector<float>& transmittance,
                         const std::vector<float>& radii,
                         uint32_t cell) {
  std::vector<float> met;
  for (const uint32_t j : delaunay.Neighbors(cell)) {
    if (j < delaunay.num_sites && transmittance[j] > 0) met.push_back(radii[j]);
  }
  return met.empty() || radii[cell] >= Median(std::move(met));
}

HiddenGraph MakeHiddenGraph(const Delaunay& delaunay,
                            const std::vector<float>& transmittance,
                            const std::vector<uint8_t>& is_opaque) {
  const uint32_t n = delaunay.num_sites;
  const auto has_color = [&](uint32_t i) { return transmittance[i] >= kHiddenTransmittance; };
  HiddenGraph result;
  std::vector<uint32_t> node_of(n, kNoCell);
  const auto add_node = [&](uint32_t cell) {
    if (node_of[cell] != kNoCell) return;
    node_of[cell] = static_cast<uint32_t>(result.cells.size());
    result.cells.push_back(cell);
  };
  for (uint32_t i = 0; i < n; ++i) {
    if (!has_color(i)) add_node(i);
  }
  result.num_without_color = result.cells.size();
  for (size_t h = 0; h < result.num_without_color; ++h) {
    for (const uint32_t j : delaunay.Neighbors(result.cells[h])) {
      if (j < n && is_opaque[j] != 0) add_node(j);
    }
  }
  ConductanceGraph& graph = result.graph;
  graph.offsets.push_back(0);
  for (const uint32_t i : result.cells) {
    for (const uint32_t j : delaunay.Neighbors(i)) {
      if (j >= n || node_of[j] == kNoCell || (has_color(i) && has_color(j))) continue;
      graph.neighbors.push_back(node_of[j]);
    }
    graph.offsets.push_back(static_cast<uint32_t>(graph.neighbors.size()));
  }
  graph.conductance.assign(graph.neighbors.size(), 1.f);
  return result;
}

void SetColor(const Eigen::Vector3f& color, uint32_t cell, Foam* foam) {
  float* const sh = &foam->sh[size_t{cell} * foam->ShStride()];
  std::fill_n(sh, foam->ShStride(), 0.f);
  for (int k = 0; k < 3; ++k) sh[k] = (color[k] - 0.5f) / static_cast<float>(kShDc);
  if (foam->HasColorGradients()) {
    std::fill_n(&foam->color_gradient[size_t{cell} * kColorGradientDim], kColorGradientDim, 0.f);
  }
}

}  // namespace

int64_t RecolorHiddenCells(const Delaunay& delaunay,
                           const std::vector<float>& transmittance,
                           Foam* foam,
                           std::vector<Eigen::Vector3f>* mean_color) {
  const uint32_t n = delaunay.num_sites;
  CHECK_EQ(n, foam->NumSites());
  CHECK_EQ(n, transmittance.size());
  CHECK_EQ(n, mean_color->size());
  const std::vector<float> radii = CellRadii(WithGuardSites(foam->positions), delaunay);
  std::vector<uint8_t> is_opaque(n);
  for (uint32_t i = 0; i < n; ++i) {
    is_opaque[i] = CellOpacity(Density(foam->raw_density[i]), radii[i]) > 0;
  }
  const HiddenGraph hidden = MakeHiddenGraph(delaunay, transmittance, is_opaque);

  // The fourth number is 1 where there is a way to a seen cell, else 0.
  std::vector<float> hold(hidden.cells.size(), 0.f);
  std::vector<Eigen::Vector4f> target(hidden.cells.size(), Eigen::Vector4f::Zero());
  for (size_t k = hidden.num_without_color; k < hidden.cells.size(); ++k) {
    hold[k] = kFirmHold;
    target[k] << (*mean_color)[hidden.cells[k]], 1;
  }
  const std::vector<Eigen::Vector4f> extended = ExtendHarmonically<4>(hidden.graph, hold, target);
  int64_t num_changed = 0;
  for (size_t k = 0; k < hidden.num_without_color; ++k) {
    const uint32_t cell = hidden.cells[k];
    if (is_opaque[cell] == 0 || extended[k][3] < 0.5f) continue;
    if (transmittance[cell] == 0 && !IsLargeEnoughToMeet(delaunay, transmittance, radii, cell)) {
      continue;
    }
    const Eigen::Vector3f color = extended[k].head<3>().cwiseMax(0.f).cwiseMin(1.f);
    SetColor(color, cell, foam);
    (*mean_color)[cell] = color;
    ++num_changed;
  }
  return num_changed;
}

}  // namespace semfoam
