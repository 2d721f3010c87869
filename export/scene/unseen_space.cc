// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/unseen_space.h"

#include "foam/util/min_cut.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <glog/logging.h>

namespace semfoam {

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
  MinCut cut(unseen.size());
  for (size_t node = 0; node < unseen.size(); ++node) {
    const uint32_t cell = unseen[node];
    int64_t to_inside = 0, to_open = 0;
    for (uint32_t e = delaunay.offsets[cell]; e < delaunay.offsets[cell + 1]; ++e) {
      const uint32_t next = delaunay.neighbors[e];
      const int64_t area = static_cast<int64_t>(face_areas[e] * unit);
      if (is_unseen(next)) {
        if (cell < next) cut.AddEdge(node, node_of.at(next), area, area);
      } else if (next < delaunay.num_sites && knowledge[next] == CellKnowledge::kInside) {
        to_inside += area;
      } else {
        to_open += area;
      }
    }
    cut.AddTerminals(node, to_inside, to_open);
  }
  const std::vector<uint8_t> is_inside = cut.SourceSide();
  std::vector<uint32_t> hidden;
  for (size_t node = 0; node < unseen.size(); ++node) {
    if (is_inside[node]) hidden.push_back(unseen[node]);
  }
  std::sort(hidden.begin(), hidden.end());
  return hidden;
}

}  // namespace semfoam
