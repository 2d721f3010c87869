// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/unseen_space.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Boost's own form of a flow network.
using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
using Network = boost::adjacency_list<
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

void AddEdge(Network* network, size_t from, size_t to, int64_t forth, int64_t back) {
  const auto edge = boost::add_edge(from, to, *network).first;
  const auto reverse = boost::add_edge(to, from, *network).first;
  boost::put(boost::edge_capacity, *network, edge, forth);
  boost::put(boost::edge_capacity, *network, reverse, back);
  boost::put(boost::edge_reverse, *network, edge, reverse);
  boost::put(boost::edge_reverse, *network, reverse, edge);
}

}  // namespace

std::vector<uint32_t> UnseenInside(const Delaunay& delaunay,
                                   const std::vector<double>& face_areas,
                                   const std::vector<CellKnowledge>& knowledge,
                                   const std::vector<uint32_t>& inside) {
  CHECK_EQ(face_areas.size(), delaunay.neighbors.size());
  CHECK_EQ(knowledge.size(), delaunay.num_cells);
  const auto is_unseen = [&](uint32_t cell) {
    return cell < delaunay.num_sites && knowledge[cell] == CellKnowledge::kUnseen;
  };
  // The unseen cells that can be reached from the object without crossing what is seen.
  std::vector<uint32_t> unseen;
  std::unordered_map<uint32_t, size_t> node_of;
  const auto reach = [&](uint32_t cell) {
    for (const uint32_t next : delaunay.Neighbors(cell)) {
      if (is_unseen(next) && node_of.emplace(next, unseen.size()).second) unseen.push_back(next);
    }
  };
  for (const uint32_t cell : inside) reach(cell);
  for (size_t k = 0; k < unseen.size(); ++k) reach(unseen[k]);
  if (unseen.empty()) return {};

  double total_area = 0;
  for (const uint32_t cell : unseen) {
    for (uint32_t e = delaunay.offsets[cell]; e < delaunay.offsets[cell + 1]; ++e) {
      total_area += face_areas[e];
    }
  }
  const double unit = total_area > 0 ? std::ldexp(1.0, 61) / total_area : 0;
  const size_t source = unseen.size(), sink = source + 1;
  Network network(unseen.size() + 2);
  for (size_t node = 0; node < unseen.size(); ++node) {
    const uint32_t cell = unseen[node];
    int64_t to_inside = 0, to_open = 0;
    for (uint32_t e = delaunay.offsets[cell]; e < delaunay.offsets[cell + 1]; ++e) {
      const uint32_t next = delaunay.neighbors[e];
      const int64_t area = static_cast<int64_t>(face_areas[e] * unit);
      if (is_unseen(next)) {
        if (cell < next) AddEdge(&network, node, node_of.at(next), area, area);
      } else if (next < delaunay.num_sites && knowledge[next] == CellKnowledge::kInside) {
        to_inside += area;
      } else {
        to_open += area;
      }
    }
    if (to_inside > 0) AddEdge(&network, source, node, to_inside, 0);
    if (to_open > 0) AddEdge(&network, node, sink, to_open, 0);
  }
  boost::boykov_kolmogorov_max_flow(network, source, sink);
  // The search tree of the source is what is left of its side.
  std::vector<uint32_t> hidden;
  const auto color = boost::get(boost::vertex_color, network);
  const auto side = boost::color_traits<boost::default_color_type>::black();
  for (size_t node = 0; node < unseen.size(); ++node) {
    if (color[node] == side) hidden.push_back(unseen[node]);
  }
  std::sort(hidden.begin(), hidden.end());
  return hidden;
}

}  // namespace semfoam
