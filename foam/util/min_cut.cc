// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/min_cut.h"

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Boost's own form of a flow network.
using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
using Graph = boost::adjacency_list<
    boost::vecS,
    boost::vecS,
    boost::directedS,
    boost::property<boost::vertex_index_t,
                    long,
                    boost::property<boost::vertex_color_t,
                                    boost::default_color_type,
                                    boost::property<boost::vertex_distance_t,
                                                    long,
                                                    boost::property<boost::vertex_predecessor_t,
                                                                    Traits::edge_descriptor>>>>,
    boost::property<
        boost::edge_capacity_t,
        int64_t,
        boost::property<boost::edge_residual_capacity_t,
                        int64_t,
                        boost::property<boost::edge_reverse_t, Traits::edge_descriptor>>>>;

}  // namespace

struct MinCut::Network {
  explicit Network(size_t num_nodes) : graph(num_nodes) {}
  Graph graph;
};

MinCut::MinCut(size_t num_nodes)
    : num_nodes_(num_nodes), network_(std::make_unique<Network>(num_nodes + 2)) {}

MinCut::~MinCut() = default;

void MinCut::AddEdge(size_t from, size_t to, int64_t forth, int64_t back) {
  CHECK_GE(forth, 0);
  CHECK_GE(back, 0);
  Graph& graph = network_->graph;
  const auto edge = boost::add_edge(from, to, graph).first;
  const auto reverse = boost::add_edge(to, from, graph).first;
  boost::put(boost::edge_capacity, graph, edge, forth);
  boost::put(boost::edge_capacity, graph, reverse, back);
  boost::put(boost::edge_reverse, graph, edge, reverse);
  boost::put(boost::edge_reverse, graph, reverse, edge);
}

void MinCut::AddTerminals(size_t node, int64_t from_source, int64_t to_sink) {
  CHECK_LT(node, num_nodes_);
  if (from_source > 0) AddEdge(num_nodes_, node, from_source, 0);
  if (to_sink > 0) AddEdge(node, num_nodes_ + 1, to_sink, 0);
}

std::vector<uint8_t> MinCut::SourceSide() {
  Graph& graph = network_->graph;
  boost::boykov_kolmogorov_max_flow(graph, num_nodes_, num_nodes_ + 1);
  // The search tree of the source is what is left of its side.
  const auto color = boost::get(boost::vertex_color, graph);
  const auto side = boost::color_traits<boost::default_color_type>::black();
  std::vector<uint8_t> is_source_side(num_nodes_);
  for (size_t node = 0; node < num_nodes_; ++node) is_source_side[node] = color[node] == side;
  return is_source_side;
}

}  // namespace semfoam
