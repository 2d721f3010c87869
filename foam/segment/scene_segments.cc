// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/scene_segments.h"

#include "foam/model/cell_labels.h"
#include "foam/segment/creases.h"
#include "foam/segment/dominant_planes.h"
#include "foam/segment/surface_graph.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <set>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kLeastPlane = 0.04;
// At granularity 0: the concavity of creases, and shares of what photos show: of a region that
// stays one, of which at least kLeastShare at any granularity, and of a piece that is not cut.
constexpr double kConcavity = 0.6, kShare = 0.003, kLeastShare = 0.0005, kMostWhole = 0.12;
// Cells that fewer rays show than this part of the median are chance: in the crevice between two
// things there is matter that joins them.
constexpr float kLeastShown = 0.3f;
// Radii from a plane: what lies on it, and rough parts of it.
constexpr float kOnPlane = 2.5f, kRough = 4;
constexpr float kRoughNormal = 0.5f;  // cosine
constexpr double kLeastRough = 0.5, kLeastBehind = 0.8;
// Squares of a footprint around a place.
constexpr int kRingsOn = 1, kRingsBehind = 2;
constexpr int kMostSweeps = 30;

// Segments while they are found, by node: the planes are the first ones.
class SegmentSearch {
 public:
  SegmentSearch(const SurfaceGraph& graph, double granularity)
      : graph_(graph),
        planes_(FindDominantPlanes(graph, kLeastPlane)),
        segment_(graph.NumNodes(), kNoSegment) {
    for (const DominantPlane& plane : planes_) footprints_.emplace_back(graph, plane);
    for (int32_t p = 0; p < NumPlanes(); ++p) {
      for (const uint32_t node : planes_[p].nodes) segment_[node] = p;
    }
    FindThings(granularity);
    JoinPlanes();
    Grow();
  }

  int32_t NumPlanes() const { return static_cast<int32_t>(planes_.size()); }
  // [nodes] Planes, then things, not all of which have nodes; kNoSegment where nothing is near.
  const std::vector<int32_t>& segment() const { return segment_; }

 private:
  // The larger of the radii of a cell and of those of a plane.
  float RadiusAt(const DominantPlane& plane, uint32_t node) const {
    return std::max(plane.radius, graph_.radii[node]);
  }

  bool IsOnAPlane(uint32_t node) const {
    const Eigen::Vector3f& x = graph_.positions[node];
    for (int32_t p = 0; p < NumPlanes(); ++p) {
      if (std::abs(planes_[p].Height(x)) < kOnPlane * RadiusAt(planes_[p], node) &&
          footprints_[p].IsAt(x, kRingsOn)) {
        return true;
      }
    }
    return false;
  }

  void FindThings(double granularity) {
    std::vector<uint8_t> stands_apart(graph_.NumNodes(), 0);
    const float least_shown = kLeastShown * Median(std::vector<float>(graph_.weights));
    for (uint32_t node = 0; node < stands_apart.size(); ++node) {
      stands_apart[node] =
          segment_[node] == kNoSegment && !IsOnAPlane(node) && graph_.weights[node] >= least_shown;
    }
    const double coarse = 1 - granularity, total = graph_.TotalWeight();
    const double least = std::max(kLeastShare, kShare * coarse) * total;
    const double most_whole = kMostWhole * coarse * total;
    num_segments_ = NumPlanes();
    std::vector<uint8_t> is_cut(graph_.NumNodes(), 0);
    for (const std::vector<uint32_t>& piece : ComponentsOfNodes(graph_, stands_apart)) {
      const double weight = graph_.WeightOf(piece);
      if (weight > most_whole) {
        for (const uint32_t node : piece) is_cut[node] = 1;
      } else if (weight >= least) {
        for (const uint32_t node : piece) segment_[node] = num_segments_;
        ++num_segments_;
      }
    }
    const std::vector<int32_t> regions =
        CutAtCreases(graph_, is_cut, kConcavity * coarse * coarse, least);
    std::vector<double> weights(1 + *std::max_element(regions.begin(), regions.end()), 0);
    for (uint32_t node = 0; node < regions.size(); ++node) {
      if (regions[node] != kNoRegion) weights[regions[node]] += graph_.weights[node];
    }
    for (uint32_t node = 0; node < regions.size(); ++node) {
      const int32_t region = regions[node];
      if (region != kNoRegion && weights[region] >= least) segment_[node] = num_segments_ + region;
    }
    num_segments_ += static_cast<int32_t>(weights.size());
  }

  // Gives the planes their rough parts, and what is behind them.
  void JoinPlanes() {
    std::vector<std::vector<uint32_t>> nodes(num_segments_);
    // A segment, and a plane beside it.
    std::set<std::pair<int32_t, int32_t>> beside;
    for (uint32_t node = 0; node < segment_.size(); ++node) {
      if (segment_[node] == kNoSegment) continue;
      nodes[segment_[node]].push_back(node);
      for (const uint32_t other : graph_.Neighbors(node)) {
        const int32_t p = segment_[other];
        if (p != kNoSegment && p < NumPlanes()) beside.emplace(segment_[node], p);
      }
    }
    for (int32_t s = NumPlanes(); s < num_segments_; ++s) {
      int32_t best = kNoSegment;
      double most = 0;
      for (int32_t p = 0; p < NumPlanes(); ++p) {
        if (!beside.contains({s, p})) continue;
        const double share = ShareOfPlane(nodes[s], p);
        if (share <= most) continue;
        most = share;
        best = p;
      }
      if (best == kNoSegment) continue;
      for (const uint32_t node : nodes[s]) segment_[node] = best;
    }
  }

  // Returns which share of a segment is a rough part of a plane, or behind it; 0 where that is too
  // little for the whole of it to be the plane's.
  double ShareOfPlane(const std::vector<uint32_t>& nodes, int32_t p) const {
    const DominantPlane& plane = planes_[p];
    double all = 0, rough = 0, behind = 0;
    for (const uint32_t node : nodes) {
      const Eigen::Vector3f& x = graph_.positions[node];
      const double weight = graph_.weights[node];
      const float height = plane.Height(x);
      all += weight;
      if (std::abs(height) < kRough * RadiusAt(plane, node) &&
          graph_.normals[node].dot(plane.normal) > kRoughNormal) {
        rough += weight;
      }
      if (height < -plane.radius && footprints_[p].IsAt(x, kRingsBehind)) behind += weight;
    }
    const double share_rough = rough / all, share_behind = behind / all;
    return std::max(share_rough >= kLeastRough ? share_rough : 0,
                    share_behind >= kLeastBehind ? share_behind : 0);
  }

  // Gives nodes without a segment that with which they share the largest faces, from its border
  // outwards.
  void Grow() {
    std::vector<uint32_t> left;
    for (uint32_t node = 0; node < segment_.size(); ++node) {
      if (segment_[node] == kNoSegment) left.push_back(node);
    }
    for (int sweep = 0; sweep < kMostSweeps && !left.empty(); ++sweep) {
      std::vector<std::pair<uint32_t, int32_t>> joined;
      for (const uint32_t node : left) {
        std::map<int32_t, double> areas;
        const std::span<const uint32_t> neighbors = graph_.Neighbors(node);
        for (size_t k = 0; k < neighbors.size(); ++k) {
          const int32_t s = segment_[neighbors[k]];
          if (s != kNoSegment) areas[s] += graph_.FaceAreasOf(node)[k];
        }
        if (areas.empty()) continue;
        const auto most = std::max_element(
            areas.begin(), areas.end(), [](auto& a, auto& b) { return a.second < b.second; });
        joined.emplace_back(node, most->first);
      }
      for (const auto& [node, s] : joined) segment_[node] = s;
      std::erase_if(left, [&](uint32_t node) { return segment_[node] != kNoSegment; });
    }
  }

  const SurfaceGraph& graph_;
  std::vector<DominantPlane> planes_;
  std::vector<PlaneFootprint> footprints_;
  int32_t num_segments_ = 0;
  std::vector<int32_t> segment_;
};

// Gives solid cells that have none the segment of the nearest cell that has one, on ways through
// solid cells.
void SpreadThroughMatter(const Foam& foam,
                         const Delaunay& delaunay,
                         const std::vector<uint8_t>& solid,
                         std::vector<int32_t>* segment_of_cell) {
  using Step = std::pair<float, uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> queue;
  std::vector<float> way(delaunay.num_sites, std::numeric_limits<float>::infinity());
  for (uint32_t cell = 0; cell < delaunay.num_sites; ++cell) {
    if ((*segment_of_cell)[cell] == kNoSegment) continue;
    way[cell] = 0;
    queue.push({0, cell});
  }
  while (!queue.empty()) {
    const auto [length, cell] = queue.top();
    queue.pop();
    if (length > way[cell]) continue;
    for (const uint32_t next : delaunay.Neighbors(cell)) {
      if (next >= delaunay.num_sites || solid[next] == 0) continue;
      const float to_next = length + (foam.positions[next] - foam.positions[cell]).norm();
      if (!(to_next < way[next])) continue;
      way[next] = to_next;
      (*segment_of_cell)[next] = (*segment_of_cell)[cell];
      queue.push({to_next, next});
    }
  }
}

}  // namespace

SceneSegments FindSceneSegments(const Model& model, const Delaunay& delaunay, double granularity) {
  CHECK(granularity >= 0 && granularity <= 1);
  const CellLabels labels = LabelCells(model.foam, delaunay);
  const SurfaceGraph graph = BuildSurfaceGraph(model, delaunay, labels);
  SceneSegments result;
  result.segment_of_cell.assign(model.foam.NumSites(), kNoSegment);
  if (graph.NumNodes() == 0) return result;
  const SegmentSearch search(graph, granularity);

  // Numbers those that have nodes: planes first, the largest first.
  std::map<int32_t, double> weights;
  for (uint32_t node = 0; node < graph.NumNodes(); ++node) {
    const int32_t s = search.segment()[node];
    if (s != kNoSegment) weights[s] += graph.weights[node];
  }
  std::vector<int32_t> order;
  for (const auto& [s, weight] : weights) order.push_back(s);
  const auto is_plane = [&](int32_t s) { return s < search.NumPlanes(); };
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    return is_plane(a) != is_plane(b) ? is_plane(a) : weights[a] > weights[b];
  });
  std::map<int32_t, int32_t> number;
  for (const int32_t s : order) {
    number[s] = static_cast<int32_t>(result.segments.size());
    result.segments.push_back({is_plane(s), weights[s] / graph.TotalWeight(), 0});
  }
  for (uint32_t node = 0; node < graph.NumNodes(); ++node) {
    const int32_t s = search.segment()[node];
    if (s != kNoSegment) result.segment_of_cell[graph.cells[node]] = number[s];
  }
  SpreadThroughMatter(model.foam, delaunay, labels.solid, &result.segment_of_cell);
  for (const int32_t s : result.segment_of_cell) {
    if (s != kNoSegment) ++result.segments[s].cells;
  }
  return result;
}

}  // namespace semfoam
