// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_association.h"

#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <utility>

namespace semfoam {
namespace {

// Clusters are joined while their links meet at least this much, counted over the photos of both
// (intersection over union), with so many links' weight of doubt.
constexpr double kJoinOverlap = 0.3;
constexpr double kJoinDoubt = 3;

class Association {
 public:
  Association(const Evidence& evidence, const std::vector<int32_t>& node_of_region, int num_nodes)
      : clusters_(num_nodes), root_(num_nodes) {
    std::iota(root_.begin(), root_.end(), 0);
    for (size_t r = 0; r < evidence.regions.size(); ++r) {
      clusters_[node_of_region[r]].views.insert(evidence.regions[r].view);
    }
    for (const Observation& observation : evidence.observations) {
      const int32_t node = node_of_region[observation.region];
      evidence.ForEachLink(observation, [&](const Observation& other, float weight) {
        const int32_t other_node = node_of_region[other.region];
        clusters_[node].links_to_view[evidence.regions[other.region].view] += weight;
        if (other_node == node) return;
        clusters_[node].links[other_node] += weight;
        clusters_[other_node].links[node] += weight;
      });
    }
    for (int32_t node = 0; node < num_nodes; ++node) PushAll(node, /*larger_only=*/true);
    Join();
  }

  // Returns the cluster of each node, by one of its nodes.
  std::vector<int32_t> Roots() const {
    std::vector<int32_t> roots(root_.size());
    for (size_t i = 0; i < roots.size(); ++i) roots[i] = Root(static_cast<int32_t>(i));
    return roots;
  }

 private:
  struct Cluster {
    std::set<int32_t> views;
    std::map<int32_t, double> links_to_view;  // to any region of that view
    std::map<int32_t, double> links;          // to other clusters and back, both directions
    int version = 0;
    bool is_joined = false;  // into another
  };
  struct Candidate {
    double overlap;
    int32_t a, b;
    int version_a, version_b;
    bool operator<(const Candidate& other) const {
      if (overlap != other.overlap) return overlap < other.overlap;
      return std::pair(a, b) > std::pair(other.a, other.b);
    }
  };

  int32_t Root(int32_t node) const {
    while (root_[node] != node) node = root_[node];
    return node;
  }

  static double LinksTo(const Cluster& cluster, const std::set<int32_t>& views) {
    double sum = 0;
    for (const auto& [view, weight] : cluster.links_to_view) {
      if (views.contains(view)) sum += weight;
    }
    return sum;
  }

  void Push(int32_t a, int32_t b) {
    if (a > b) std::swap(a, b);
    const Cluster& first = clusters_[a];
    const Cluster& second = clusters_[b];
    const auto links = first.links.find(b);
    if (links == first.links.end()) return;
    const double common = links->second / 2;
    const double all = LinksTo(first, second.views) + LinksTo(second, first.views) - common;
    const double overlap = common / (all + kJoinDoubt);
    if (overlap < kJoinOverlap) return;
    queue_.push({overlap, a, b, first.version, second.version});
  }

  void PushAll(int32_t node, bool larger_only) {
    for (const auto& [other, weight] : clusters_[node].links) {
      if (!larger_only || other > node) Push(node, other);
    }
  }

  void Join() {
    while (!queue_.empty()) {
      const Candidate candidate = queue_.top();
      queue_.pop();
      Cluster& kept = clusters_[candidate.a];
      Cluster& gone = clusters_[candidate.b];
      if (kept.is_joined || gone.is_joined || kept.version != candidate.version_a ||
          gone.version != candidate.version_b) {
        continue;
      }
      root_[candidate.b] = candidate.a;
      gone.is_joined = true;
      ++kept.version;
      kept.views.insert(gone.views.begin(), gone.views.end());
      for (const auto& [view, weight] : gone.links_to_view) kept.links_to_view[view] += weight;
      for (const auto& [other, weight] : gone.links) {
        clusters_[other].links.erase(candidate.b);
        if (other == candidate.a) continue;
        kept.links[other] += weight;
        clusters_[other].links[candidate.a] += weight;
      }
      gone = Cluster();
      gone.is_joined = true;
      PushAll(candidate.a, /*larger_only=*/false);
    }
  }

  std::vector<Cluster> clusters_;
  std::vector<int32_t> root_;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

std::vector<int32_t> ClusterNodes(const Evidence& evidence,
                                  const std::vector<int32_t>& node_of_region,
                                  int num_nodes) {
  return Association(evidence, node_of_region, num_nodes).Roots();
}

}  // namespace semfoam
