// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/hidden_cells.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/render/color_variation.h"
#include "foam/train/harmonic_extension.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The hidden cells, opaque or not, and the opaque ones beside them that photos see.
struct HiddenGraph {
  // Cells of the nodes: first the hidden ones.
  std::vector<uint32_t> cells;
  size_t num_hidden = 0;
  // Edges with a hidden cell at one end at least, all of conductance 1.
  ConductanceGraph graph;
  // Whether a way leads from the node to a seen cell.
  std::vector<uint8_t> reaches_seen;
};

// Returns whether a cell shows in no more than `share` of the rays that could meet it.
bool IsHidden(const CellMeasurements& measured, float share, uint32_t cell) {
  const float rays = measured.potential_rays[cell];
  if (rays > 0 && rays < kFewestPotentialRays) return false;
  return measured.weight[cell] <= share * rays;
}

// Returns whether a hidden cell lies where photos look, and none sees it.
bool IsUnseen(const CellMeasurements& measured, uint32_t cell) {
  return measured.potential_rays[cell] > 0 && measured.transmittance[cell] < kUnseenTransmittance;
}

HiddenGraph MakeHiddenGraph(const Delaunay& delaunay,
                            const CellMeasurements& measured,
                            const std::vector<uint8_t>& is_opaque,
                            float share) {
  const uint32_t n = delaunay.num_sites;
  std::vector<uint8_t> is_hidden(n);
  HiddenGraph result;
  std::vector<uint32_t> node_of(n, kNoCell);
  const auto add_node = [&](uint32_t cell) {
    if (node_of[cell] != kNoCell) return;
    node_of[cell] = static_cast<uint32_t>(result.cells.size());
    result.cells.push_back(cell);
  };
  for (uint32_t i = 0; i < n; ++i) {
    is_hidden[i] = IsHidden(measured, share, i);
    if (is_hidden[i] != 0) add_node(i);
  }
  result.num_hidden = result.cells.size();
  for (size_t h = 0; h < result.num_hidden; ++h) {
    for (const uint32_t j : delaunay.Neighbors(result.cells[h])) {
      if (j < n && is_opaque[j] != 0) add_node(j);
    }
  }
  ConductanceGraph& graph = result.graph;
  graph.offsets.push_back(0);
  for (const uint32_t i : result.cells) {
    for (const uint32_t j : delaunay.Neighbors(i)) {
      if (j >= n || node_of[j] == kNoCell || is_hidden[i] + is_hidden[j] == 0) continue;
      graph.neighbors.push_back(node_of[j]);
    }
    graph.offsets.push_back(static_cast<uint32_t>(graph.neighbors.size()));
  }
  graph.conductance.assign(graph.neighbors.size(), 1.f);

  std::vector<uint8_t>& reaches_seen = result.reaches_seen;
  reaches_seen.assign(result.cells.size(), 0);
  std::fill(reaches_seen.begin() + result.num_hidden, reaches_seen.end(), uint8_t{1});
  std::vector<uint32_t> front(result.cells.size() - result.num_hidden);
  std::iota(front.begin(), front.end(), static_cast<uint32_t>(result.num_hidden));
  while (!front.empty()) {
    const uint32_t node = front.back();
    front.pop_back();
    for (uint32_t e = graph.offsets[node]; e < graph.offsets[node + 1]; ++e) {
      const uint32_t next = graph.neighbors[e];
      if (reaches_seen[next] != 0) continue;
      reaches_seen[next] = 1;
      front.push_back(next);
    }
  }
  return result;
}

// Returns the harmonic extension of the values of the graph's seen cells to its hidden ones:
// [nodes].
template <int Dim, typename ValueOf>
std::vector<Eigen::Matrix<float, Dim, 1>> ExtendFromSeenCells(const HiddenGraph& hidden,
                                                              ValueOf&& value_of) {
  std::vector<float> hold(hidden.cells.size(), 0.f);
  std::vector<Eigen::Matrix<float, Dim, 1>> target(hidden.cells.size(),
                                                   Eigen::Matrix<float, Dim, 1>::Zero());
  for (size_t k = hidden.num_hidden; k < hidden.cells.size(); ++k) {
    hold[k] = kFirmHold;
    target[k] = value_of(hidden.cells[k]);
  }
  return ExtendHarmonically<Dim>(hidden.graph, hold, target);
}

void SetColor(const Eigen::Vector3f& color, uint32_t cell, Foam* foam) {
  float* const sh = &foam->sh[size_t{cell} * foam->ShStride()];
  std::fill_n(sh, foam->ShStride(), 0.f);
  for (int k = 0; k < 3; ++k) sh[k] = (color[k] - 0.5f) / static_cast<float>(kShDc);
  if (foam->HasColorGradients()) {
    std::fill_n(&foam->color_gradient[size_t{cell} * kColorGradientDim], kColorGradientDim, 0.f);
  }
}

// Gives hidden cells, opaque or unseen, the harmonic extensions of the identities of seen ones.
void CompleteIdentities(const Delaunay& delaunay,
                        const CellMeasurements& measured,
                        const std::vector<uint8_t>& is_opaque,
                        Foam* foam) {
  using Identity = Eigen::Matrix<float, kIdentityDim, 1>;
  const auto identity_of = [&](uint32_t cell) {
    return Eigen::Map<Identity>(&foam->identity[size_t{cell} * kIdentityDim]);
  };
  const HiddenGraph hidden = MakeHiddenGraph(delaunay, measured, is_opaque, kHiddenIdentityShare);
  const std::vector<Identity> extended = ExtendFromSeenCells<kIdentityDim>(hidden, identity_of);
  for (size_t k = 0; k < hidden.num_hidden; ++k) {
    const uint32_t cell = hidden.cells[k];
    if (hidden.reaches_seen[k] == 0) continue;
    if (is_opaque[cell] == 0 && !IsUnseen(measured, cell)) continue;
    identity_of(cell) = extended[k];
  }
}

}  // namespace

HiddenCellChanges CompleteHiddenCells(const Delaunay& delaunay,
                                      CellMeasurements* measured,
                                      Foam* foam) {
  const uint32_t n = delaunay.num_sites;
  std::vector<Eigen::Vector3f>& mean_color = measured->statistics.mean_color;
  CHECK_EQ(n, foam->NumSites());
  CHECK_EQ(n, measured->transmittance.size());
  CHECK_EQ(n, measured->weight.size());
  CHECK_EQ(n, measured->potential_rays.size());
  CHECK_EQ(n, mean_color.size());
  const std::vector<float> radii = CellRadii(WithGuardSites(foam->positions), delaunay);
  std::vector<uint8_t> is_opaque(n);
  for (uint32_t i = 0; i < n; ++i) {
    is_opaque[i] = CellOpacity(Density(foam->raw_density[i]), radii[i]) > 0;
  }
  const HiddenGraph hidden = MakeHiddenGraph(delaunay, *measured, is_opaque, kHiddenShare);

  const std::vector<Eigen::Vector3f> extended =
      ExtendFromSeenCells<3>(hidden, [&](uint32_t cell) { return mean_color[cell]; });
  HiddenCellChanges changes;
  std::vector<float> assumed_density(n, 0.f);
  for (size_t k = 0; k < hidden.num_hidden; ++k) {
    const uint32_t cell = hidden.cells[k];
    const bool is_unseen = IsUnseen(*measured, cell) && radii[cell] > 0;
    if (hidden.reaches_seen[k] == 0 || (is_opaque[cell] == 0 && !is_unseen)) continue;
    const Eigen::Vector3f color = extended[k].cwiseMax(0.f).cwiseMin(1.f);
    SetColor(color, cell, foam);
    mean_color[cell] = color;
    changes.recolored += is_opaque[cell];
    if (!is_unseen) continue;
    assumed_density[cell] = kFilledOpticalDepth / radii[cell];
    ++changes.filled;
  }
  if (foam->HasSemantics()) CompleteIdentities(delaunay, *measured, is_opaque, foam);
  if (changes.filled > 0) foam->assumed_density = std::move(assumed_density);
  return changes;
}

}  // namespace semfoam
