// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/min_cut.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

struct Edge {
  size_t from, to;
  int64_t forth, back;
};

struct Terminal {
  int64_t from_source, to_sink;
};

int64_t CostOf(uint32_t source_side,
               const std::vector<Edge>& edges,
               const std::vector<Terminal>& terminals) {
  const auto is_source_side = [&](size_t node) { return (source_side >> node & 1) != 0; };
  int64_t cost = 0;
  for (const Edge& edge : edges) {
    if (is_source_side(edge.from) && !is_source_side(edge.to)) cost += edge.forth;
    if (is_source_side(edge.to) && !is_source_side(edge.from)) cost += edge.back;
  }
  for (size_t node = 0; node < terminals.size(); ++node) {
    cost += is_source_side(node) ? terminals[node].to_sink : terminals[node].from_source;
  }
  return cost;
}

// Held against all cuts of small networks: the cost is the least, and of the cuts that cost so
// little it is the one with the fewest nodes on the source's side.
TEST(MinCut, CostsTheLeastOfAllCuts) {
  std::mt19937 random(3);
  const auto below = [&](int64_t limit) { return static_cast<int64_t>(random()) % limit; };
  for (int round = 0; round < 200; ++round) {
    const size_t num_nodes = 1 + random() % 9;
    std::vector<Edge> edges;
    std::vector<Terminal> terminals;
    MinCut cut(num_nodes);
    for (size_t k = 0; k < 2 * num_nodes; ++k) {
      const Edge edge = {random() % num_nodes, random() % num_nodes, below(5), below(5)};
      if (edge.from == edge.to) continue;
      edges.push_back(edge);
      cut.AddEdge(edge.from, edge.to, edge.forth, edge.back);
    }
    for (size_t node = 0; node < num_nodes; ++node) {
      terminals.push_back({below(7), below(7)});
      cut.AddTerminals(node, terminals[node].from_source, terminals[node].to_sink);
    }
    int64_t least = std::numeric_limits<int64_t>::max();
    uint32_t best = 0;
    for (uint32_t side = 0; side < 1u << num_nodes; ++side) {
      const int64_t cost = CostOf(side, edges, terminals);
      if (cost > least || (cost == least && std::popcount(side) >= std::popcount(best))) continue;
      least = cost;
      best = side;
    }
    const std::vector<uint8_t> source_side = cut.SourceSide();
    ASSERT_EQ(source_side.size(), num_nodes);
    uint32_t side = 0;
    for (size_t node = 0; node < num_nodes; ++node) side |= uint32_t{source_side[node]} << node;
    ASSERT_EQ(side, best) << "round " << round;
  }
}

TEST(MinCut, WithoutNodesThereIsNothingToCut) { EXPECT_TRUE(MinCut(0).SourceSide().empty()); }

}  // namespace
}  // namespace semfoam
