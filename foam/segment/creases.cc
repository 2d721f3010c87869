// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/creases.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// What a way between neighbours is longer by, in cells for each unit of turn (1 - cosine), of
// colour and of concavity. Smoothed normals turn over several cells in a crease, so that a patch
// would lie across it if concave turns counted no more than others.
constexpr float kTurn = 7, kColor = 7, kConcave = 13;
// Length of the ways in a patch from its seed to the next one.
constexpr float kPatch = 5;

// Returns the concavity between two places of a surface: that of a valley is above 0.
template <typename Vector>
double Concavity(const Vector& from,
                 const Vector& from_normal,
                 const Vector& to,
                 const Vector& to_normal) {
  const Vector way = to - from;
  return (from_normal - to_normal).dot(way) / std::max<double>(way.norm(), 1e-12);
}

float Way(const SurfaceGraph& graph, uint32_t from, uint32_t to) {
  const Eigen::Vector3f &x = graph.positions[from], &y = graph.positions[to];
  const Eigen::Vector3f &n = graph.normals[from], &m = graph.normals[to];
  const float cells = (x - y).norm() / (2 * std::max({graph.radii[from], graph.radii[to], 1e-9f}));
  const auto concave = static_cast<float>(std::max(0.0, Concavity(x, n, y, m)));
  return 1e-6f + cells * (1 + kTurn * (1 - n.dot(m)) + kConcave * concave +
                          kColor * (graph.colors[from] - graph.colors[to]).norm());
}

// Returns the patch of each node, and their number.
std::pair<std::vector<int32_t>, int32_t> MakePatches(const SurfaceGraph& graph,
                                                     const std::vector<uint8_t>& is_in) {
  std::vector<uint32_t> order;
  for (uint32_t node = 0; node < graph.NumNodes(); ++node) {
    if (is_in[node] != 0) order.push_back(node);
  }
  // What photos show best begins.
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return graph.weights[a] > graph.weights[b];
  });
  std::vector<int32_t> patch(graph.NumNodes(), kNoRegion);
  std::vector<float> way(graph.NumNodes(), std::numeric_limits<float>::infinity());
  int32_t num_patches = 0;
  using Step = std::pair<float, uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> queue;
  for (const uint32_t seed : order) {
    if (way[seed] < kPatch) continue;
    way[seed] = 0;
    patch[seed] = num_patches;
    queue.push({0, seed});
    while (!queue.empty()) {
      const auto [length, node] = queue.top();
      queue.pop();
      if (length > way[node]) continue;
      for (const uint32_t next : graph.Neighbors(node)) {
        if (is_in[next] == 0) continue;
        const float to_next = length + Way(graph, node, next);
        if (!(to_next < std::min(way[next], 2 * kPatch))) continue;
        way[next] = to_next;
        patch[next] = num_patches;
        queue.push({to_next, next});
      }
    }
    ++num_patches;
  }
  return {std::move(patch), num_patches};
}

// The border of two regions: its length in rays, and the sum over it of the concavity.
struct Border {
  double length = 0;
  double concave = 0;

  double Concavity() const { return concave / std::max(length, 1e-12); }
};

// Regions that join, with their weights and borders.
class RegionGraph {
 public:
  RegionGraph(const SurfaceGraph& graph, const std::vector<int32_t>& patch, int32_t num_patches)
      : weights_(num_patches, 0),
        parents_(num_patches),
        versions_(num_patches, 0),
        borders_(num_patches) {
    std::iota(parents_.begin(), parents_.end(), 0);
    std::vector<Eigen::Vector3d> middles(num_patches, Eigen::Vector3d::Zero());
    std::vector<Eigen::Vector3d> normals(num_patches, Eigen::Vector3d::Zero());
    for (uint32_t node = 0; node < patch.size(); ++node) {
      const int32_t p = patch[node];
      if (p == kNoRegion) continue;
      const double weight = graph.weights[node];
      weights_[p] += weight;
      middles[p] += weight * graph.positions[node].cast<double>();
      normals[p] += weight * graph.normals[node].cast<double>();
    }
    for (int32_t p = 0; p < num_patches; ++p) {
      middles[p] /= weights_[p];
      normals[p] /= std::max(normals[p].norm(), 1e-12);
    }
    for (uint32_t node = 0; node < patch.size(); ++node) {
      for (const uint32_t other : graph.Neighbors(node)) {
        const int32_t p = patch[node], q = patch[other];
        if (node > other || p == q || p == kNoRegion || q == kNoRegion) continue;
        const double concavity = Concavity(middles[p], normals[p], middles[q], normals[q]);
        // The square root of what photos show of the smaller cell is about its width in rays.
        const double length = std::sqrt(std::min(graph.weights[node], graph.weights[other]));
        for (const auto& [from, to] : {std::pair(p, q), {q, p}}) {
          Border& border = borders_[from][to];
          border.length += length;
          border.concave += length * concavity;
        }
      }
    }
  }

  // Joins the pair with the least concavity, up to `most_concave`.
  void JoinUpTo(double most_concave) {
    using Pair = std::tuple<double, int32_t, int32_t, int32_t, int32_t>;
    std::priority_queue<Pair, std::vector<Pair>, std::greater<>> queue;
    const auto add = [&](int32_t p, int32_t q, const Border& border) {
      queue.push({border.Concavity(),
                  std::min(p, q),
                  std::max(p, q),
                  versions_[std::min(p, q)],
                  versions_[std::max(p, q)]});
    };
    for (int32_t p = 0; p < std::ssize(borders_); ++p) {
      for (const auto& [q, border] : borders_[p]) {
        if (p < q) add(p, q, border);
      }
    }
    while (!queue.empty()) {
      const auto [concavity, p, q, version_p, version_q] = queue.top();
      if (concavity > most_concave) break;
      queue.pop();
      if (versions_[p] != version_p || versions_[q] != version_q) continue;
      Join(q, p);
      for (const auto& [r, border] : borders_[p]) add(p, r, border);
    }
  }

  // Joins regions below `least_weight`, the smallest first, with the neighbour with the longest,
  // least concave border.
  void JoinSmall(double least_weight) {
    std::vector<int32_t> small;
    for (int32_t p = 0; p < std::ssize(parents_); ++p) {
      if (parents_[p] == p && weights_[p] < least_weight) small.push_back(p);
    }
    std::stable_sort(small.begin(), small.end(), [&](int32_t a, int32_t b) {
      return weights_[a] < weights_[b];
    });
    for (const int32_t p : small) {
      if (parents_[p] != p || weights_[p] >= least_weight || borders_[p].empty()) continue;
      const auto best = std::max_element(
          borders_[p].begin(), borders_[p].end(), [](const auto& a, const auto& b) {
            return a.second.length * (1 - a.second.Concavity()) <
                   b.second.length * (1 - b.second.Concavity());
          });
      Join(p, best->first);
    }
  }

  int32_t RegionOf(int32_t patch) const {
    while (parents_[patch] != patch) patch = parents_[patch];
    return patch;
  }

 private:
  // Makes region `from` a part of `into`.
  void Join(int32_t from, int32_t into) {
    parents_[from] = into;
    weights_[into] += weights_[from];
    ++versions_[from];
    ++versions_[into];
    for (const auto& [other, border] : borders_[from]) {
      borders_[other].erase(from);
      if (other == into) continue;
      for (const auto& [a, b] : {std::pair(into, other), {other, into}}) {
        Border& joint = borders_[a][b];
        joint.length += border.length;
        joint.concave += border.concave;
      }
    }
    borders_[from].clear();
  }

  // [patches]
  std::vector<double> weights_;
  // The region that a patch or region is a part of; itself: it is a region.
  std::vector<int32_t> parents_;
  // How often a region has changed.
  std::vector<int32_t> versions_;
  std::vector<std::map<int32_t, Border>> borders_;
};

}  // namespace

std::vector<int32_t> CutAtCreases(const SurfaceGraph& graph,
                                  const std::vector<uint8_t>& is_in,
                                  double most_concave,
                                  double least_weight) {
  CHECK_EQ(is_in.size(), graph.NumNodes());
  std::vector<int32_t> region(graph.NumNodes(), kNoRegion);
  const auto [patch, num_patches] = MakePatches(graph, is_in);
  RegionGraph regions(graph, patch, num_patches);
  regions.JoinUpTo(most_concave);
  regions.JoinSmall(least_weight);
  std::vector<int32_t> number(num_patches, kNoRegion);
  int32_t num_regions = 0;
  for (uint32_t node = 0; node < region.size(); ++node) {
    if (patch[node] == kNoRegion) continue;
    int32_t& of_region = number[regions.RegionOf(patch[node])];
    if (of_region == kNoRegion) of_region = num_regions++;
    region[node] = of_region;
  }
  return region;
}

}  // namespace semfoam
