// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/surface_graph.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr float kLeastContribution = 0.05f;
constexpr float kMostWeight = 20;  // of the median
constexpr float kLeastWeight = 1e-3f;
constexpr int kSmoothings = 3;
// What a node's own normal counts beside those of its neighbours, and what a neighbour counts at
// least in the first smoothing, where normals are those of single cells.
constexpr float kOwnShare = 0.5f;
constexpr float kLeastAgreement = 0.1f;
// Of the faces to air that look all ways alike, this part of their area is left by rounding.
constexpr float kNoDirection = 1e-5f;
constexpr int64_t kBlock = 1024;

std::vector<uint8_t> FindMatter(const CellStatistics& statistics, const CellLabels& labels) {
  std::vector<uint8_t> is_matter = labels.solid;
  for (size_t i = 0; i < is_matter.size(); ++i) {
    if (IsHaze(statistics, i)) is_matter[i] = 0;
  }
  return is_matter;
}

Eigen::Vector3f Direction(const Eigen::Vector3f& vector) {
  const float length = vector.norm();
  return length > 0 ? Eigen::Vector3f(vector / length) : Eigen::Vector3f::Zero();
}

// Replaces each normal by the mean of its neighbours' and its own.
void SmoothNormals(float least_agreement, SurfaceGraph* graph) {
  std::vector<Eigen::Vector3f> smoothed(graph->NumNodes());
  const auto count = static_cast<int64_t>(graph->NumNodes());
  ParallelForBlocks(count, kBlock, [&](int64_t begin, int64_t end) {
    for (auto node = static_cast<uint32_t>(begin); node < end; ++node) {
      const Eigen::Vector3f& own = graph->normals[node];
      const std::span<const uint32_t> neighbors = graph->Neighbors(node);
      const std::span<const float> areas = graph->FaceAreasOf(node);
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float weights = 0;
      for (size_t k = 0; k < neighbors.size(); ++k) {
        const Eigen::Vector3f& other = graph->normals[neighbors[k]];
        const float weight = areas[k] * std::max(least_agreement, own.dot(other));
        sum += weight * other;
        weights += weight;
      }
      const Eigen::Vector3f direction = Direction(sum + kOwnShare * weights * own);
      smoothed[node] = direction.isZero(0) ? own : direction;
    }
  });
  graph->normals = std::move(smoothed);
}

// Limits the weights to kMostWeight times their median, and to what sums of them can hold.
void LimitWeights(std::vector<float>* weights) {
  std::vector<float> shown;
  std::copy_if(
      weights->begin(), weights->end(), std::back_inserter(shown), [](float w) { return w > 0; });
  const float median = shown.empty() ? 1 : Median(std::move(shown));
  const float most = std::clamp(kMostWeight * median, 1e-20f, 1e20f);
  for (float& weight : *weights) weight = std::clamp(weight, kLeastWeight * most, most);
}

}  // namespace

double SurfaceGraph::WeightOf(std::span<const uint32_t> nodes) const {
  return std::accumulate(nodes.begin(), nodes.end(), 0.0, [this](double sum, uint32_t node) {
    return sum + weights[node];
  });
}

double SurfaceGraph::TotalWeight() const {
  return std::accumulate(weights.begin(), weights.end(), 0.0);
}

SurfaceGraph BuildSurfaceGraph(const Model& model,
                               const Delaunay& delaunay,
                               const CellLabels& labels) {
  const Foam& foam = model.foam;
  const CellStatistics& statistics = model.statistics;
  CHECK_EQ(statistics.contribution.size(), foam.NumSites());
  CHECK_EQ(statistics.mean_color.size(), foam.NumSites());
  CHECK_EQ(statistics.passed.size(), foam.NumSites());
  CHECK_EQ(statistics.stopped.size(), foam.NumSites());
  CHECK_EQ(labels.solid.size(), foam.NumSites());
  const std::vector<Eigen::Vector3f> positions = WithGuardSites(foam.positions);
  const std::vector<double> all_areas =
      FaceAreas(positions, delaunay, VoronoiVertices(positions, delaunay));
  const std::vector<float> all_radii = CellRadii(positions, delaunay);
  const std::vector<uint8_t> is_matter = FindMatter(statistics, labels);
  const auto face_area = [&](uint32_t cell, uint32_t other, size_t edge) {
    const float radius =
        other < delaunay.num_sites ? std::min(all_radii[cell], all_radii[other]) : all_radii[cell];
    return std::min(static_cast<float>(all_areas[edge]),
                    std::numbers::pi_v<float> * radius * radius);
  };

  SurfaceGraph graph;
  graph.node_of_cell.assign(foam.NumSites(), -1);
  for (uint32_t cell = 0; cell < foam.NumSites(); ++cell) {
    if (is_matter[cell] == 0 || statistics.contribution[cell] < kLeastContribution) continue;
    Eigen::Vector3f outwards = Eigen::Vector3f::Zero();
    float area = 0;
    for (uint32_t edge = delaunay.offsets[cell]; edge < delaunay.offsets[cell + 1]; ++edge) {
      const uint32_t other = delaunay.neighbors[edge];
      if (other < delaunay.num_sites && is_matter[other] != 0) continue;
      const float of_face = face_area(cell, other, edge);
      outwards += of_face * Direction(positions[other] - positions[cell]);
      area += of_face;
    }
    if (!(outwards.norm() > kNoDirection * area)) continue;
    graph.node_of_cell[cell] = static_cast<int32_t>(graph.cells.size());
    graph.cells.push_back(cell);
    graph.positions.push_back(positions[cell]);
    graph.radii.push_back(all_radii[cell]);
    graph.normals.push_back(Direction(outwards));
    graph.weights.push_back(statistics.stopped[cell]);
    graph.colors.push_back(statistics.mean_color[cell]);
  }
  LimitWeights(&graph.weights);
  graph.offsets.push_back(0);
  for (const uint32_t cell : graph.cells) {
    for (uint32_t edge = delaunay.offsets[cell]; edge < delaunay.offsets[cell + 1]; ++edge) {
      const uint32_t other = delaunay.neighbors[edge];
      if (other >= delaunay.num_sites || graph.node_of_cell[other] < 0) continue;
      graph.neighbors.push_back(static_cast<uint32_t>(graph.node_of_cell[other]));
      graph.face_areas.push_back(face_area(cell, other, edge));
    }
    graph.offsets.push_back(static_cast<uint32_t>(graph.neighbors.size()));
  }
  for (int i = 0; i < kSmoothings; ++i) SmoothNormals(i == 0 ? kLeastAgreement : 0, &graph);
  return graph;
}

std::vector<std::vector<uint32_t>> ComponentsOfNodes(const SurfaceGraph& graph,
                                                     const std::vector<uint8_t>& is_in) {
  CHECK_EQ(is_in.size(), graph.NumNodes());
  std::vector<uint8_t> todo = is_in;
  std::vector<std::vector<uint32_t>> components;
  for (uint32_t first = 0; first < todo.size(); ++first) {
    if (todo[first] == 0) continue;
    todo[first] = 0;
    std::vector<uint32_t> component = {first};
    for (size_t k = 0; k < component.size(); ++k) {
      for (const uint32_t next : graph.Neighbors(component[k])) {
        if (todo[next] != 0) component.push_back(next);
        todo[next] = 0;
      }
    }
    std::sort(component.begin(), component.end());
    components.push_back(std::move(component));
  }
  return components;
}

}  // namespace semfoam
