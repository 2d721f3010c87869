// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/dominant_planes.h"

#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kCandidates = 400;
constexpr size_t kJudges = 20000;
constexpr float kNearness = 2;       // of the cell's radius
constexpr float kSameNormal = 0.7f;  // cosine
constexpr int kFits = 6;
// A connected part of a plane: of the share that a plane has at least, and of its largest part.
constexpr double kLeastPart = 0.3, kLeastPartOfLargest = 0.05;
constexpr int kMostFailures = 8;
constexpr float kSquare = 4;  // of the plane's radius

bool IsNear(const SurfaceGraph& graph,
            uint32_t node,
            const Eigen::Vector3f& point,
            const Eigen::Vector3f& normal) {
  return std::abs((graph.positions[node] - point).dot(normal)) < kNearness * graph.radii[node] &&
         graph.normals[node].dot(normal) > kSameNormal;
}

// Returns `count` of the nodes, spread evenly over their weight, each possibly several times.
std::vector<uint32_t> SpreadByWeight(const SurfaceGraph& graph,
                                     const std::vector<uint32_t>& nodes,
                                     size_t count) {
  const double total = graph.WeightOf(nodes);
  std::vector<uint32_t> chosen;
  double before = 0;
  for (const uint32_t node : nodes) {
    before += graph.weights[node];
    while (chosen.size() < count && (static_cast<double>(chosen.size()) + 0.5) * total <=
                                        before * static_cast<double>(count)) {
      chosen.push_back(node);
    }
  }
  return chosen;
}

// Returns the node whose plane has the most judges near it.
uint32_t BestCandidate(const SurfaceGraph& graph, const std::vector<uint32_t>& left) {
  const std::vector<uint32_t> candidates = SpreadByWeight(graph, left, kCandidates);
  const std::vector<uint32_t> judges = SpreadByWeight(graph, left, std::min(kJudges, left.size()));
  std::vector<int64_t> votes(candidates.size());
  ParallelForBlocks(std::ssize(candidates), 8, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const uint32_t node = candidates[i];
      votes[i] = std::count_if(judges.begin(), judges.end(), [&](uint32_t judge) {
        return IsNear(graph, judge, graph.positions[node], graph.normals[node]);
      });
    }
  });
  return candidates[std::max_element(votes.begin(), votes.end()) - votes.begin()];
}

// Fits the plane to the nodes near it by least squares, kFits times. Cells count by what photos
// show of them and how small they are. Nodes in a row, no wider than their cells, tell where the
// plane is, not which way it looks: it keeps its normal. Returns the nodes that the last fit was
// made to.
std::vector<uint32_t> FitToNodes(const SurfaceGraph& graph,
                                 const std::vector<uint32_t>& left,
                                 Eigen::Vector3f* point,
                                 Eigen::Vector3f* normal) {
  std::vector<uint32_t> near;
  for (int fit = 0; fit < kFits; ++fit) {
    near.clear();
    std::copy_if(left.begin(), left.end(), std::back_inserter(near), [&](uint32_t node) {
      return IsNear(graph, node, *point, *normal);
    });
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double sum = 0;
    const auto weight_of = [&](uint32_t node) {
      const double radius = std::max(graph.radii[node], 1e-9f);
      return graph.weights[node] / (radius * radius);
    };
    for (const uint32_t node : near) {
      middle += weight_of(node) * graph.positions[node].cast<double>();
      sum += weight_of(node);
    }
    if (near.size() < 3 || !(sum > 0)) break;
    middle /= sum;
    *point = middle.cast<float>();
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    double squared_radius = 0;
    for (const uint32_t node : near) {
      const Eigen::Vector3d offset = graph.positions[node].cast<double>() - middle;
      moments += weight_of(node) / sum * offset * offset.transpose();
      squared_radius += weight_of(node) / sum * graph.radii[node] * graph.radii[node];
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
    if (!(axes.eigenvalues()[1] > squared_radius)) continue;
    const Eigen::Vector3f least = axes.eigenvectors().col(0).cast<float>();
    *normal = least.dot(*normal) < 0 ? Eigen::Vector3f(-least) : least;
  }
  return near;
}

}  // namespace

std::vector<DominantPlane> FindDominantPlanes(const SurfaceGraph& graph, double least_share) {
  CHECK_GT(least_share, 0);
  const double least = least_share * graph.TotalWeight();
  std::vector<DominantPlane> planes;
  std::vector<uint32_t> left(graph.NumNodes());
  std::iota(left.begin(), left.end(), 0u);
  int failures = 0;
  while (failures < kMostFailures && !left.empty() && graph.WeightOf(left) >= least) {
    const uint32_t best = BestCandidate(graph, left);
    Eigen::Vector3f point = graph.positions[best], normal = graph.normals[best];
    const std::vector<uint32_t> near = FitToNodes(graph, left, &point, &normal);
    if (near.size() < 3 || graph.WeightOf(near) < least) break;
    std::vector<uint8_t> is_near(graph.NumNodes(), 0);
    for (const uint32_t node : near) is_near[node] = 1;
    std::vector<std::vector<uint32_t>> parts = ComponentsOfNodes(graph, is_near);
    std::vector<double> weights;
    for (const std::vector<uint32_t>& part : parts) weights.push_back(graph.WeightOf(part));
    const size_t largest = std::max_element(weights.begin(), weights.end()) - weights.begin();
    if (weights[largest] < least) {
      // Not connected: what is left of it may still be in other planes.
      std::fill(is_near.begin(), is_near.end(), 0);
      for (const uint32_t node : parts[largest]) is_near[node] = 1;
      ++failures;
    } else {
      for (size_t i = 0; i < parts.size(); ++i) {
        if (weights[i] < std::max(kLeastPart * least, kLeastPartOfLargest * weights[largest]))
          continue;
        std::vector<float> radii;
        for (const uint32_t node : parts[i]) radii.push_back(graph.radii[node]);
        planes.push_back({normal, point, Median(std::move(radii)), std::move(parts[i])});
      }
    }
    std::erase_if(left, [&](uint32_t node) { return is_near[node] != 0; });
  }
  std::stable_sort(planes.begin(), planes.end(), [&](const auto& a, const auto& b) {
    return graph.WeightOf(a.nodes) > graph.WeightOf(b.nodes);
  });
  return planes;
}

PlaneFootprint::PlaneFootprint(const SurfaceGraph& graph, const DominantPlane& plane)
    : point_(plane.point),
      column_axis_(plane.normal.unitOrthogonal()),
      row_axis_(plane.normal.cross(column_axis_)),
      edge_(kSquare * std::max(plane.radius, 1e-6f)) {
  for (const uint32_t node : plane.nodes) occupied_.insert(KeyOf(graph.positions[node], 0, 0));
}

int64_t PlaneFootprint::KeyOf(const Eigen::Vector3f& x, int column_offset, int row_offset) const {
  // Far beyond any plane: a key has room for no more squares.
  constexpr float kMostSquares = 1 << 30;
  const Eigen::Vector3f offset = x - point_;
  const auto square = [&](const Eigen::Vector3f& axis) {
    return static_cast<int64_t>(
        std::clamp(std::floor(offset.dot(axis) / edge_), -kMostSquares, kMostSquares));
  };
  return ((square(row_axis_) + row_offset) << 32) + square(column_axis_) + column_offset;
}

bool PlaneFootprint::IsAt(const Eigen::Vector3f& x, int rings) const {
  for (int row = -rings; row <= rings; ++row) {
    for (int column = -rings; column <= rings; ++column) {
      if (occupied_.contains(KeyOf(x, column, row))) return true;
    }
  }
  return false;
}

}  // namespace semfoam
